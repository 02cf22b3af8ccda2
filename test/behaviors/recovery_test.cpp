#include "behaviors/recovery.h"

#include <limits>

#include <gtest/gtest.h>

namespace dive::behaviors {
namespace {

TEST(RecoveryOptions, NamesWhatIsOutOfRange) {
  RecoveryOptions options;
  EXPECT_EQ(options.validate(), "");
  options.blocked_trail.detour_clearances[2] = 0.0;
  EXPECT_NE(options.validate().find("blocked_trail.detour_clearances is 0"), std::string::npos);
  options.back_off.min_clearance = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(options.validate().find("back_off.min_clearance"), std::string::npos);
}

TEST(LegRecovery, ReportsUnreachableOnceForEachPath) {
  RecoveryOptions options;
  options.unreachable_after = 3;
  LegRecovery recovery(0.6, options);
  for (int path = 0; path < 2; ++path) {
    for (int failure = 1; failure <= 5; ++failure) {
      recovery.plan_failed(0);
      EXPECT_EQ(recovery.reports_unreachable(), failure == 3) << failure;
    }
    recovery.path_found(true);
    EXPECT_FALSE(recovery.reports_unreachable());
  }
}

// A path to observe the goal from is not a path to the goal.
TEST(LegRecovery, CountsFailuresUntilAPathLeadsToTheGoal) {
  LegRecovery recovery(0.6, {});
  recovery.plan_failed(0);
  recovery.path_found(false);
  recovery.plan_failed(0);
  EXPECT_EQ(recovery.failures(), 2);
  EXPECT_TRUE(recovery.reports_unreachable());
  recovery.path_found(true);
  EXPECT_EQ(recovery.failures(), 0);
}

TEST(LegRecovery, InAKnownEnvironmentOnlyWaits) {
  LegRecovery recovery(0.6, {});
  for (int i = 0; i < 10; ++i) recovery.plan_failed(from_seconds(4.0));
  EXPECT_TRUE(recovery.is_pausing(from_seconds(4.99)));
  EXPECT_FALSE(recovery.is_pausing(from_seconds(5.0)));
  estimation::StateEstimate estimate;
  BehaviorInput input;
  input.estimate = &estimate;
  input.map_changed = true;
  EXPECT_FALSE(recovery.attitude_to_observe(input, {5, 0, -3}));
  EXPECT_FALSE(recovery.place_to_observe(input, {5, 0, -3}, {}));
  EXPECT_FALSE(recovery.is_too_near(input));
}

}  // namespace
}  // namespace dive::behaviors
