// A short version of bench/stress_planner: on random worlds no path is nearer to an obstacle than
// its certificate states.

#include <algorithm>

#include <gtest/gtest.h>

#include "planning/planner.h"
#include "test/common/sanitizers.h"
#include "test/planning/brute_force.h"
#include "test/planning/random_world.h"
#include "vehicle/model.h"

namespace dive::planning {
namespace {

constexpr double kNearlyEnough = 0.85;  // share of D_min acceptable for a start that lacks D_min
constexpr std::uint64_t kWorlds = dive::testing::kUnderSanitizers ? 2 : 10;
constexpr double kGrace = 0.005;  // m

class RandomWorlds : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomWorlds, HoldNoPathThatIsNearerThanCertified) {
  Diagnostics diagnostics;
  const auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  ASSERT_TRUE(model);
  SteadyClock clock;
  int solved = 0;
  for (std::uint64_t seed = GetParam(); seed < GetParam() + kWorlds; ++seed) {
    const testing::RandomQuestion question = testing::random_question(seed, model->hull);
    Planner planner(question.world, model->hull, {}, clock);
    const PlanResult result = planner.plan(question.request);
    if (!has_path(result.status)) {
      EXPECT_FALSE(result.reason.empty());
      continue;
    }
    ++solved;
    const double at_start =
        testing::measured_clearance(question.world, model->hull, {question.request.start}, 0.0);
    // A start with less clearance than required is allowed to leave.
    const double asked = question.request.limits.clearance;
    const bool is_reduced = result.status == PlanStatus::kReduced;
    EXPECT_EQ(is_reduced, result.clearance_m < asked - 1e-6) << "world " << seed;
    EXPECT_TRUE(!is_reduced || at_start < asked + kGrace) << "world " << seed;
    const double least = is_reduced ? std::min(kNearlyEnough * asked, at_start) : asked;
    EXPECT_GE(result.clearance_m, least - kGrace);
    const double at_least = result.clearance_m - testing::measured_too_little(question.world);
    EXPECT_GE(testing::measured_clearance(question.world, model->hull, result.waypoints, at_least),
              at_least)
        << "world " << seed;
  }
  EXPECT_GE(solved, static_cast<int>(kWorlds * 7 / 10));
}

INSTANTIATE_TEST_SUITE_P(Tens, RandomWorlds, ::testing::Range<std::uint64_t>(20'000, 20'030, 10));

}  // namespace
}  // namespace dive::planning
