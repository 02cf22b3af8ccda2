#include "behaviors/monitors.h"

#include <limits>

#include <gtest/gtest.h>

#include "common/se3.h"

namespace dive::behaviors {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

MonitorLimits limits() {
  MonitorLimits limits;
  for (std::size_t i = 0; i < kFailsafeCount; ++i) {
    limits.threshold[i] = traits(static_cast<FailsafeKind>(i)).threshold;
  }
  limits.threshold[static_cast<std::size_t>(FailsafeKind::kCommsLost)] = 1e6;  // its own test's
  limits.threshold[static_cast<std::size_t>(FailsafeKind::kBattery)] = 0.3;
  limits.max_depth = 10.0;
  limits.min_altitude = 0.5;
  limits.mission_timeout_s = 600.0;
  return limits;
}

// A vehicle with working sensors that swims east at 0.4 m/s, until a test changes something.
class MonitorsTest : public ::testing::Test {
 protected:
  void use(const MonitorLimits& limits) { monitors_ = Monitors(limits); }

  void tick() {
    now_ += 20'000;
    wiggle_ = -wiggle_;  // noise: a working sensor never repeats its value for long
    imu_.utime = depth_.utime = health_.utime = now_;
    imu_.q_WB = from_rpy(0.0, 0.0, wiggle_);
    if (!is_depth_frozen_) depth_.depth_m = -estimate_.X_WB.p.z() + wiggle_;
    if (imu_spoils_) imu_.q_WB.x() = kNan;
    if (depth_spoils_) depth_.depth_m = kNan;
    if (imu_speaks_) accepted_imu_ = monitors_.accept(now_, imu_);
    if (depth_speaks_) accepted_depth_ = monitors_.accept(now_, depth_);
    if (health_speaks_) accepted_health_ = monitors_.accept(now_, health_);
    if (moves_) estimate_.X_WB.p.x() += 0.008;
    MonitorInput input = input_;
    input.now = now_;
    input.elapsed_s = to_seconds(now_);
    input.estimate = &estimate_;
    conditions_ = monitors_.update(input);
  }
  void run(double seconds) {
    for (const Utime end = now_ + from_seconds(seconds); now_ < end;) tick();
  }
  [[nodiscard]] bool is(FailsafeKind kind) const {
    return conditions_[static_cast<std::size_t>(kind)];
  }
  [[nodiscard]] std::vector<std::string> what() const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < kFailsafeCount; ++i) {
      if (conditions_[i]) names.emplace_back(to_string(static_cast<FailsafeKind>(i)));
    }
    return names;
  }

  void SetUp() override {
    estimate_.valid = true;
    estimate_.X_WB.p = {0, 0, -5};
    input_.command.v = 0.4;
    input_.command.d = 5.0;
    monitors_.start(now_);
    run(1.0);
    ASSERT_EQ(what(), std::vector<std::string>{}) << "nothing is wrong at first";
  }

  Monitors monitors_{limits()};
  MonitorInput input_;
  estimation::StateEstimate estimate_;
  ImuSample imu_;
  DepthSample depth_;
  HealthSample health_;
  bool imu_speaks_ = true, depth_speaks_ = true, health_speaks_ = true;
  bool imu_spoils_ = false, depth_spoils_ = false, is_depth_frozen_ = false;
  bool moves_ = true;
  bool accepted_imu_ = false, accepted_depth_ = false, accepted_health_ = false;
  double wiggle_ = 1e-3;
  Utime now_ = 0;
  FailsafeConditions conditions_{};
};

using Only = std::vector<std::string>;

TEST_F(MonitorsTest, Leak) {
  health_.leak = true;
  tick();
  EXPECT_EQ(what(), Only{"leak"});
}

TEST_F(MonitorsTest, BatteryAndTemperatureHaveThresholds) {
  health_.battery_fraction = 0.31;
  health_.temperature_c = 59.0;
  tick();
  EXPECT_EQ(what(), Only{});
  health_.battery_fraction = 0.29;
  tick();
  EXPECT_EQ(what(), Only{"battery"});
  health_.battery_fraction = 1.0;
  health_.temperature_c = 61.0;
  tick();
  EXPECT_EQ(what(), Only{"temperature"});
}

TEST_F(MonitorsTest, OverdepthUsesTheSensorBeforeTheEstimate) {
  estimate_.X_WB.p.z() = -10.5;
  depth_speaks_ = false;
  run(1.0);
  EXPECT_FALSE(is(FailsafeKind::kOverdepth)) << "the last depth is a second old and 5 m";
  depth_speaks_ = true;
  tick();
  EXPECT_TRUE(is(FailsafeKind::kOverdepth));
}

TEST_F(MonitorsTest, AltitudeIsWatchedWhereThereIsGround) {
  input_.altitude_m = 0.6;
  tick();
  EXPECT_EQ(what(), Only{});
  input_.altitude_m = 0.4;
  tick();
  EXPECT_EQ(what(), Only{"min_altitude"});
  input_.altitude_m.reset();
  tick();
  EXPECT_EQ(what(), Only{});
}

TEST_F(MonitorsTest, TheFenceMayBeAnyPolygon) {
  MonitorLimits fenced = limits();
  fenced.fence = {{-5, -5}, {5, -5}, {5, 5}, {0, 0}, {-5, 5}};  // a notch from the north
  use(fenced);
  for (const auto& [x, y, outside] :
       {std::tuple{-1.0, -1.0, false}, std::tuple{0.0, 2.0, true}, std::tuple{4.0, 3.5, false},
        std::tuple{6.0, 0.0, true}, std::tuple{0.0, -6.0, true}}) {
    estimate_.X_WB.p.head<2>() << x - 0.008, y;  // the tick moves it on
    tick();
    EXPECT_EQ(is(FailsafeKind::kGeofence), outside) << x << ", " << y;
  }
}

TEST_F(MonitorsTest, OvertimeAndOverdueLegs) {
  input_.leg_expected_s = 20.0;
  input_.leg_elapsed_s = 89.0;
  tick();
  EXPECT_EQ(what(), Only{});
  input_.leg_elapsed_s = 91.0;  // three times, and half a minute
  tick();
  EXPECT_EQ(what(), Only{"leg_timeout"});
  input_.leg_expected_s = 0.0;
  now_ = from_seconds(600.0);
  run(1.0);
  EXPECT_TRUE(is(FailsafeKind::kMissionTimeout));
  EXPECT_FALSE(is(FailsafeKind::kLegTimeout));
}

TEST_F(MonitorsTest, StuckIsWantingToMoveAndNotMoving) {
  moves_ = false;
  run(29.0);
  EXPECT_EQ(what(), Only{});
  run(2.0);
  EXPECT_EQ(what(), Only{"stuck"});
  input_.command.v = 0.0;  // it does not want to any more
  tick();
  EXPECT_EQ(what(), Only{});
  input_.command.d = 4.0;  // up, but it stays where it is
  run(31.0);
  EXPECT_EQ(what(), Only{"stuck"});
}

TEST_F(MonitorsTest, AQuietSensorIsLostAndANanIsSilence) {
  imu_speaks_ = false;
  run(0.6);
  EXPECT_EQ(what(), Only{"imu_lost"});
  imu_speaks_ = true;
  imu_spoils_ = true;
  run(0.6);
  EXPECT_FALSE(accepted_imu_);
  EXPECT_EQ(what(), Only{"imu_lost"});
  imu_spoils_ = false;
  tick();
  EXPECT_EQ(what(), Only{});

  depth_spoils_ = true;
  run(1.9);
  EXPECT_FALSE(accepted_depth_);
  EXPECT_EQ(what(), Only{});
  run(0.2);
  EXPECT_EQ(what(), Only{"depth_lost"});
  EXPECT_EQ(monitors_.depth_loss(), SensorLoss::kSilent);

  depth_spoils_ = false;
  health_speaks_ = false;
  run(31.0);
  EXPECT_EQ(what(), Only{"health_lost"});
}

TEST_F(MonitorsTest, InAnUnknownEnvironmentRangeIsLostByTheAgeOfTheNewestScan) {
  run(30.0);
  EXPECT_EQ(what(), Only{}) << "a dive without range data does not miss them";
  MonitorLimits unknown = limits();
  unknown.watches_range = true;
  use(unknown);
  monitors_.start(now_);
  run(1.9);
  EXPECT_EQ(what(), Only{});
  run(0.2);
  EXPECT_EQ(what(), Only{"range_lost"}) << "no scan yet";
  monitors_.receive_scan(now_ - from_seconds(1.5));
  tick();
  EXPECT_EQ(what(), Only{});
  run(0.6);
  EXPECT_EQ(what(), Only{"range_lost"});
  input_.rises = true;
  tick();
  EXPECT_EQ(what(), Only{}) << "a vertical ascent in open water needs no range data";
}

TEST_F(MonitorsTest, WithPositionFixesRangeIsLostByTheAgeOfTheNewestMatchedScan) {
  MonitorLimits known = limits();
  known.watches_range = true;
  use(known);
  monitors_.start(now_);
  const auto scan = [&](MapFixProblem problem) {
    MapFix fix;
    fix.scan_utime = now_;
    fix.problem = problem;
    monitors_.receive(fix);
  };
  scan(MapFixProblem::kFewPoints);
  run(1.9);
  EXPECT_EQ(what(), Only{}) << "an empty view is a scan too";
  scan(MapFixProblem::kNoScan);
  run(0.2);
  EXPECT_EQ(what(), Only{"range_lost"}) << "a repeated scan is none";
  scan(MapFixProblem::kNone);
  tick();
  EXPECT_EQ(what(), Only{});
  imu_speaks_ = false;
  run(4.0);
  EXPECT_EQ(what(), Only{"imu_lost"}) << "scans cannot be matched without attitude";
  imu_speaks_ = true;
  run(0.5);
  EXPECT_EQ(what(), Only{});
  run(2.0);
  EXPECT_EQ(what(), Only{"range_lost"});
}

TEST_F(MonitorsTest, AStallOfTheExecutiveIsNoSilenceOfTheSensors) {
  depth_speaks_ = health_speaks_ = false;  // their first samples after the stall are yet to come
  now_ += from_seconds(40.0);
  tick();
  EXPECT_EQ(what(), Only{});
  run(1.7);
  EXPECT_EQ(what(), Only{});
  run(0.4);
  EXPECT_EQ(what(), Only{"depth_lost"});
}

TEST_F(MonitorsTest, ASilentSensorIsNoticedByAnExecutiveThatStallsAgainAndAgain) {
  depth_speaks_ = false;
  for (int i = 0; i < 15; ++i) {
    now_ += from_seconds(0.5);
    tick();
  }
  EXPECT_TRUE(is(FailsafeKind::kDepthLost));
}

TEST_F(MonitorsTest, ASensorThatNeverSpokeIsMissedAsWell) {
  use(limits());
  monitors_.start(now_);
  imu_speaks_ = depth_speaks_ = health_speaks_ = false;
  run(31.0);
  EXPECT_TRUE(is(FailsafeKind::kImuLost));
  EXPECT_TRUE(is(FailsafeKind::kDepthLost));
  EXPECT_TRUE(is(FailsafeKind::kHealthLost));
}

TEST_F(MonitorsTest, AFrozenSensorIsLostWhileTheVehicleMoves) {
  is_depth_frozen_ = true;
  input_.command.v = 0.0;
  run(20.0);
  EXPECT_EQ(what(), Only{}) << "at rest it may repeat its value";
  input_.command.v = 0.4;
  run(9.0);
  EXPECT_EQ(what(), Only{});
  run(2.0);
  EXPECT_EQ(what(), Only{"depth_lost"});
  EXPECT_EQ(monitors_.depth_loss(), SensorLoss::kFrozen);
}

// Half a second between two fixes. The map's height differs from the depth by a tide.
TEST_F(MonitorsTest, AFrozenDepthIsLostOnceTheHeightByTheMapHasChanged) {
  const auto swim = [&](double seconds, double climb) {
    for (double t = 0.0; t < seconds; t += 0.5) {
      run(0.5);
      estimate_.X_WB.p.z() += 0.5 * climb;
      MapFix fix;
      fix.scan_utime = now_;
      fix.height_W = estimate_.X_WB.p.z() + 0.6;
      fix.height_sigma_m = 0.02;
      monitors_.receive(fix);
    }
    tick();
  };
  swim(3.0, -0.05);
  EXPECT_FALSE(is(FailsafeKind::kDepthLost)) << "a working sensor, whatever the tide";
  is_depth_frozen_ = true;
  swim(3.0, 0.0);
  EXPECT_FALSE(is(FailsafeKind::kDepthLost)) << "at one depth it may repeat its value";
  swim(4.0, -0.1);
  EXPECT_TRUE(is(FailsafeKind::kDepthLost));
}

TEST_F(MonitorsTest, RestsDoNotHideAFrozenSensor) {
  run(5.0);
  is_depth_frozen_ = true;
  for (int i = 0; i < 2; ++i) {  // legs of 6 s between rests that are longer than that
    input_.command.v = 0.4;
    run(6.0);
    if (i == 1) break;
    input_.command.v = 0.0;
    run(14.0);
    EXPECT_EQ(what(), Only{});
  }
  EXPECT_EQ(what(), Only{"depth_lost"});
}

// The flippers push up for the last of the way, and the depth commanded is near.
TEST_F(MonitorsTest, AFrozenDepthIsLostAlsoWhereItIsNearlyThatCommanded) {
  moves_ = false;
  is_depth_frozen_ = true;
  input_.command.v = 0.0;
  input_.command.d = -estimate_.X_WB.p.z() - 0.4;
  input_.expected_climb = 0.2;
  run(3.0);
  EXPECT_EQ(what(), Only{"depth_lost"});
  EXPECT_EQ(monitors_.depth_loss(), SensorLoss::kContradicted);
}

TEST_F(MonitorsTest, SamplesFromThePastAreNotTaken) {
  ImuSample old = imu_;
  old.utime = now_ - 1;
  EXPECT_FALSE(monitors_.accept(now_, old));
}

TEST_F(MonitorsTest, AnEstimateThatDeniesTheDepthSensorHasDiverged) {
  is_depth_frozen_ = true;  // as good as a sensor that stays at 5 m
  estimate_.X_WB.p.z() = -6.1;
  tick();
  EXPECT_TRUE(is(FailsafeKind::kEstimatorDiverged));
  estimate_.X_WB.p.z() = -5.5;
  tick();
  EXPECT_EQ(what(), Only{});
  estimate_.covariance(0, 0) = kNan;
  tick();
  EXPECT_TRUE(is(FailsafeKind::kEstimatorDiverged));
}

TEST_F(MonitorsTest, LocalisationIsLostWhereTheMarginAheadIsTooSmall) {
  estimate_.covariance.topLeftCorner<2, 2>() = 400.0 * Eigen::Matrix2d::Identity();
  tick();
  EXPECT_EQ(what(), Only{}) << "20 m off, but nothing is near";
  input_.margin_sigma = 1.6;
  tick();
  EXPECT_EQ(what(), Only{});
  input_.margin_sigma = 1.4;
  tick();
  EXPECT_EQ(what(), Only{"localisation_lost"});
}

TEST_F(MonitorsTest, TheMapIsWrongOnceScansOfSecondsContradictIt) {
  const auto scan = [&](const MapAgreement& agreement, int times) {
    for (int i = 0; i < times; ++i) {
      run(0.5);
      MapFix fix;
      fix.scan_utime = now_;
      fix.agreement = agreement;
      monitors_.receive(fix);
    }
    tick();
  };
  scan({.confirmed = 4, .missing = 2, .unmapped = 5}, 40);
  EXPECT_EQ(what(), Only{}) << "some objects are gone, others are new";
  scan({.confirmed = 0, .missing = 0, .unmapped = 3}, 40);
  EXPECT_EQ(what(), Only{}) << "a diver over a bare seabed";
  scan({.confirmed = 1, .missing = 4, .unmapped = 2}, 4);
  EXPECT_EQ(what(), Only{}) << "two seconds";
  scan({.confirmed = 1, .missing = 4, .unmapped = 2}, 4);
  EXPECT_EQ(what(), Only{"wrong_map"});
  scan({.confirmed = 8, .missing = 0, .unmapped = 0}, 12);
  EXPECT_EQ(what(), Only{});
}

TEST_F(MonitorsTest, PlannerOperatorAndRetrace) {
  input_.plan_failures = 3;
  tick();
  EXPECT_EQ(what(), Only{"planner_failure"});
  input_.plan_failures = 2;
  input_.out_of_replans = true;
  tick();
  EXPECT_EQ(what(), Only{"planner_failure"});
  input_.out_of_replans = false;
  input_.operator_abort = true;
  tick();
  EXPECT_EQ(what(), Only{"operator_abort"});
  input_.operator_abort = false;
  input_.retrace_failed = true;
  tick();
  EXPECT_EQ(what(), Only{"retrace_failure"});
}

TEST_F(MonitorsTest, ALossOfTheLogLastsForASecond) {
  tick();
  EXPECT_EQ(what(), Only{});
  monitors_.lose_log(now_);
  run(0.98);
  EXPECT_EQ(what(), Only{"log_lost"});
  run(0.1);
  EXPECT_EQ(what(), Only{});
}

TEST_F(MonitorsTest, CommsAreLostAMinuteAfterTheLastHeartbeat) {
  MonitorLimits with_comms = limits();
  with_comms.threshold[static_cast<std::size_t>(FailsafeKind::kCommsLost)] = 60.0;
  use(with_comms);
  monitors_.heartbeat(now_);
  run(59.0);
  EXPECT_EQ(what(), Only{});
  run(2.0);
  EXPECT_EQ(what(), Only{"comms_lost"});
  monitors_.heartbeat(now_);
  tick();
  EXPECT_EQ(what(), Only{});
}

}  // namespace
}  // namespace dive::behaviors
