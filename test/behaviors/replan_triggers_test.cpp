#include "behaviors/replan_triggers.h"

#include <gtest/gtest.h>

namespace dive::behaviors {
namespace {

ReplanSignals off_by(double deviation_m) {
  ReplanSignals signals;
  signals.deviation_m = deviation_m;
  return signals;
}

TEST(ReplanTriggers, PeriodCountsFromThePath) {
  ReplanPolicy policy;
  policy.period_s = 10.0;
  ReplanTriggers triggers(policy);
  triggers.path_started(from_seconds(5));
  EXPECT_EQ(triggers.update(from_seconds(14.9), off_by(0)), ReplanCause::kNone);
  EXPECT_EQ(triggers.update(from_seconds(15.0), off_by(0)), ReplanCause::kPeriod);
  EXPECT_EQ(triggers.update(from_seconds(15.1), off_by(0)), ReplanCause::kNone) << "once a period";
  EXPECT_EQ(triggers.update(from_seconds(25.0), off_by(0)), ReplanCause::kPeriod);
}

TEST(ReplanTriggers, DeviationMustPersist) {
  ReplanPolicy policy;
  policy.deviation_m = 0.5;
  ReplanTriggers triggers(policy);
  triggers.path_started(0);
  EXPECT_EQ(triggers.update(from_seconds(3.0), off_by(0.6)), ReplanCause::kNone);
  EXPECT_EQ(triggers.update(from_seconds(3.3), off_by(0.4)), ReplanCause::kNone)
      << "back on the path";
  EXPECT_EQ(triggers.update(from_seconds(3.4), off_by(0.6)), ReplanCause::kNone);
  EXPECT_EQ(triggers.update(from_seconds(3.9), off_by(0.6)), ReplanCause::kDeviation);
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
    if (triggers.update(t, off_by(5.0)) == ReplanCause::kNone) continue;
    EXPECT_GE(t - last, from_seconds(policy.min_interval_s));
    last = t;
    ++replans;
  }
  EXPECT_EQ(replans, 3);
  EXPECT_FALSE(triggers.take_one());
}

TEST(ReplanTriggers, NoProgressIsNotComingNearer) {
  ReplanPolicy policy;
  policy.no_progress_s = 10.0;
  ReplanTriggers triggers(policy);
  triggers.path_started(0);
  ReplanSignals signals;
  signals.distance_to_go_m = 20.0;
  for (int s = 0; s < 20; ++s) {  // 0.1 m/s is slow, but it is something
    signals.distance_to_go_m -= 0.1;
    EXPECT_EQ(triggers.update(from_seconds(s), signals), ReplanCause::kNone) << s;
  }
  EXPECT_EQ(triggers.update(from_seconds(27), signals), ReplanCause::kNone);
  EXPECT_EQ(triggers.update(from_seconds(30), signals), ReplanCause::kNoProgress);
  EXPECT_EQ(triggers.update(from_seconds(39), signals), ReplanCause::kNone)
      << "the count starts again";
  EXPECT_EQ(triggers.update(from_seconds(50), signals), ReplanCause::kNoProgress);
}

TEST(ReplanTriggers, EventsAreKeptUntilTheIntervalIsOver) {
  ReplanTriggers triggers(ReplanPolicy{});
  triggers.path_started(0);
  ReplanSignals signals;
  signals.path_blocked = true;
  EXPECT_EQ(triggers.update(from_seconds(0.5), signals), ReplanCause::kNone) << "too soon";
  EXPECT_EQ(triggers.update(from_seconds(2.5), ReplanSignals{}), ReplanCause::kMapChanged);
  EXPECT_EQ(triggers.update(from_seconds(9), ReplanSignals{}), ReplanCause::kNone);
}

TEST(ReplanTriggers, UseOnlyTheConfiguredTriggers) {
  ReplanPolicy policy;
  policy.clearance_m = 0.5;
  policy.map_change = policy.estimator_switch = false;
  ReplanTriggers triggers(policy);
  triggers.path_started(0);
  ReplanSignals signals;
  signals.path_blocked = signals.estimator_switched = true;
  EXPECT_EQ(triggers.update(from_seconds(3), signals), ReplanCause::kNone);
  signals.new_clearance_m = 0.6;
  EXPECT_EQ(triggers.update(from_seconds(4), signals), ReplanCause::kNone);
  signals.new_clearance_m = 0.4;
  EXPECT_EQ(triggers.update(from_seconds(5), signals), ReplanCause::kClearance);
  ReplanSignals demanded;
  demanded.demanded = true;
  EXPECT_EQ(triggers.update(from_seconds(9), demanded), ReplanCause::kDemanded);

  ReplanTriggers by_default{ReplanPolicy{}};
  by_default.path_started(0);
  ReplanSignals switched;
  switched.estimator_switched = true;
  EXPECT_EQ(by_default.update(from_seconds(3), switched), ReplanCause::kEstimatorSwitched);
}

}  // namespace
}  // namespace dive::behaviors
