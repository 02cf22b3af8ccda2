#include "behaviors/replan_triggers.h"

#include <gtest/gtest.h>

namespace dive::behaviors {
namespace {

TEST(ReplanTriggers, PeriodCountsFromThePath) {
  ReplanPolicy policy;
  policy.period_s = 10.0;
  ReplanTriggers triggers(policy);
  triggers.path_started(from_seconds(5));
  EXPECT_EQ(triggers.update(from_seconds(14.9), 0), ReplanCause::kNone);
  EXPECT_EQ(triggers.update(from_seconds(15.0), 0), ReplanCause::kPeriod);
  EXPECT_EQ(triggers.update(from_seconds(15.1), 0), ReplanCause::kNone) << "once a period";
  EXPECT_EQ(triggers.update(from_seconds(25.0), 0), ReplanCause::kPeriod);
}

TEST(ReplanTriggers, DeviationMustPersist) {
  ReplanPolicy policy;
  policy.deviation_m = 0.5;
  ReplanTriggers triggers(policy);
  triggers.path_started(0);
  EXPECT_EQ(triggers.update(from_seconds(3.0), 0.6), ReplanCause::kNone);
  EXPECT_EQ(triggers.update(from_seconds(3.3), 0.4), ReplanCause::kNone) << "back on the path";
  EXPECT_EQ(triggers.update(from_seconds(3.4), 0.6), ReplanCause::kNone);
  EXPECT_EQ(triggers.update(from_seconds(3.9), 0.6), ReplanCause::kDeviation);
}

TEST(ReplanTriggers, HaveABudgetAndAMinimumInterval) {
  ReplanPolicy policy;
  policy.deviation_m = 0.5;
  policy.max_replans = 3;
  ReplanTriggers triggers(policy);
  triggers.path_started(0);
  int replans = 0;
  Utime last = 0;
  for (Utime t = 0; t < from_seconds(60); t += 20'000) {
    if (triggers.update(t, 5.0) == ReplanCause::kNone) continue;
    EXPECT_GE(t - last, from_seconds(policy.min_interval_s));
    last = t;
    ++replans;
  }
  EXPECT_EQ(replans, 3);
  EXPECT_FALSE(triggers.take_one());
}

}  // namespace
}  // namespace dive::behaviors
