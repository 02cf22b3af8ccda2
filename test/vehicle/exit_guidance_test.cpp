// Dead reckoning of the exit against the simulator, whose equations are separate code: a vehicle
// that is handed over while it turns and heaves has a velocity that its commanded speed does not
// contain.

#include "vehicle/exit_guidance.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "test/vehicle/aqua2.h"
#include "vehicle/autopilot.h"
#include "vehicle/going_home.h"
#include "vehicle/own_autopilot.h"
#include "vehicle/simulator/simulator.h"

namespace dive::vehicle {
namespace {

using Eigen::Vector3d;

constexpr double kPathPeriod_s = 0.1;  // of the executive's exit paths

Pose place(double x, double y, double z) { return Pose{{x, y, z}}; }

/// An executive that knows the true pose and velocity, until it is killed.
struct Dive {
  Dive(const Conditions& conditions, std::uint64_t seed, bool is_fixed = false)
      : sim(testing::aqua2(), place(0, 0, -8), conditions, seed), has_fixes(is_fixed) {
    if (has_fixes) guidance = ExitGuidance({}, estimation::MapFixOptions{});
    path.position_sigma_m = 0.05;
    path.speed = 0.4;
    path.hold_s = 4.0;
    path.revision = 1;
    path.waypoints = {place(4, 1, -6), place(1, 1, -6), place(0, 4, -5), place(-4, 4, -5)};
  }

  /// Swims ahead for 10 s, then turns left and rises by heave.
  void lead(double seconds) {
    const double start_s = now_s();
    while (now_s() < start_s + seconds) {
      sense();
      const double turning_s = std::max(now_s() - 10.0, 0.0);
      Command command;
      command.v = 0.4;
      command.d = 8.0 - 0.12 * turning_s;
      command.o = from_rpy(0.0, 0.0, 0.4 * turning_s);
      rates = executive.step(command, imu.q_WB, imu.gyro_B, depth.depth_m, Simulator::kTick);
      if (now_s() < next_path_s) continue;
      next_path_s = now_s() + kPathPeriod_s;
      path.X_WB = sim.truth().X_WB;
      path.v_B = sim.truth().v_WB_B;  // still water
      ASSERT_TRUE(guidance.set_exit_path(path));
    }
  }

  /// Without the executive, for so long or until it ascends.
  void leave(double seconds) {
    const double start_s = now_s();
    own.release(sim.truth().utime);
    guidance.begin(sim.truth().utime);
    while (guidance.phase() != ExitPhase::kAscending && now_s() < start_s + seconds) {
      sense();
      rates = own.step(guidance.step(sim.truth().utime), guidance.surge(), sim.truth().utime);
    }
  }

  void sense() {
    const SensorSamples samples = sim.step(rates);
    imu = samples.imu.value_or(imu);  // the first ones are still on their way
    depth = samples.depth.value_or(depth);
    own.observe(imu, depth);
    guidance.observe(imu, depth, rates, sim.truth().utime);
    if (has_fixes && now_s() >= next_fix_s) fix();
  }

  /// A scan of half a second ago, good to 2 cm, which does not tell the heading.
  void fix() {
    next_fix_s = now_s() + 0.5;
    if (scanned.scan_utime > 0) fixes_used += guidance.propose(scanned) ? 1 : 0;
    scanned.scan_utime = sim.truth().utime;
    scanned.position_W = sim.truth().X_WB.p.head<2>();
    scanned.information.diagonal().head<2>().setConstant(1.0 / (0.02 * 0.02));
  }

  [[nodiscard]] double now_s() const { return to_seconds(sim.truth().utime); }
  [[nodiscard]] double error_m() const {
    return (sim.truth().X_WB.p - guidance.estimate().X_WB.p).head<2>().norm();
  }

  Simulator sim;
  ExitGuidance guidance;
  Autopilot executive{AutopilotOptions{}};
  OwnAutopilot own;
  ExitPath path;
  PseudoRates rates;
  ImuSample imu;
  DepthSample depth;
  double next_path_s = 0.0;
  bool has_fixes = false;
  MapFix scanned;
  double next_fix_s = 0.0;
  int fixes_used = 0;
};

TEST(ExitGuidance, KnowsWhereItStopsWhenItIsHandedOverInATurn) {
  Dive dive(testing::ideal(), 1);
  dive.lead(14.0);
  const Vector3d v_B = dive.sim.truth().v_WB_B;
  ASSERT_GT(v_B.tail<2>().norm(), 0.1) << "the commanded speed does not contain this";
  const Vector3d handed_over = dive.sim.truth().X_WB.p;
  dive.leave(3.5);
  EXPECT_EQ(dive.guidance.phase(), ExitPhase::kHolding);
  EXPECT_GT((dive.sim.truth().X_WB.p - handed_over).head<2>().norm(), 0.2) << "it coasts";
  EXPECT_LT(dive.error_m(), 0.05);
}

// With noisy sensors; compass, gait and hull are without error. One sigma at the end: the random
// walk of the primitive estimator, 0.03 m per square root of a second.
TEST(ExitGuidance, EndsWithinItsSigmaWhenItIsHandedOverInATurn) {
  constexpr int kDives = 20;
  double mean_square = 0.0;
  double mean_s = 0.0;
  for (int seed = 1; seed <= kDives; ++seed) {
    Conditions conditions = testing::ideal();
    conditions.attitude_noise_deg = 0.1;
    conditions.gyro_noise = 0.01;
    conditions.depth_noise_m = 0.01;
    conditions.sensor_latency_s = 0.02;
    Dive dive(conditions, static_cast<std::uint64_t>(seed));
    dive.lead(14.0);
    dive.leave(120.0);
    ASSERT_EQ(dive.guidance.phase(), ExitPhase::kAscending);
    ASSERT_FALSE(dive.guidance.ascended_blindly());
    mean_square += dive.error_m() * dive.error_m() / kDives;
    mean_s += (dive.now_s() - 14.0) / kDives;
  }
  RecordProperty("rms_m", std::to_string(std::sqrt(mean_square)));
  EXPECT_LT(std::sqrt(mean_square), 0.03 * std::sqrt(mean_s)) << mean_s << " s";
}

// Efforts that stop the vehicle of the motion model leave others a speed.
TEST(ExitGuidance, StopsWithARemainingSpeedOfTheStatedSigma) {
  constexpr int kVehicles = 30;
  double mean_square = 0.0;
  for (int seed = 1; seed <= kVehicles; ++seed) {
    Dive dive(Conditions{}, static_cast<std::uint64_t>(seed));
    dive.lead(9.0);
    dive.path.hold_s = 60.0;
    ASSERT_TRUE(dive.guidance.set_exit_path(dive.path));
    dive.leave(6.0);
    ASSERT_EQ(dive.guidance.phase(), ExitPhase::kHolding);
    mean_square += dive.sim.truth().v_WB_B.head<2>().squaredNorm() / kVehicles;
  }
  EXPECT_LT(std::sqrt(mean_square), kStopSigma);
  EXPECT_GT(std::sqrt(mean_square), 0.5 * kStopSigma);
}

// In a current that no mission declares, with a compass that is off.
TEST(ExitGuidance, EndsWhereItsPathEndsWithPositionFixes) {
  Conditions conditions;
  conditions.current_W = {0.04, 0.03, 0.0};
  double reckoned_m = 0.0;
  double fixed_m = 0.0;
  constexpr int kDives = 10;
  for (int seed = 1; seed <= kDives; ++seed) {
    const auto end_m = [&](Dive dive) {
      dive.lead(14.0);
      EXPECT_EQ(dive.fixes_used, 0) << "the executive's position is newer";
      dive.leave(200.0);
      EXPECT_EQ(dive.guidance.phase(), ExitPhase::kAscending);
      EXPECT_FALSE(dive.guidance.ascended_blindly());
      return (dive.sim.truth().X_WB.p - dive.path.waypoints.back().p).head<2>().norm();
    };
    reckoned_m += end_m(Dive(conditions, static_cast<std::uint64_t>(seed))) / kDives;
    fixed_m += end_m(Dive(conditions, static_cast<std::uint64_t>(seed), true)) / kDives;
  }
  EXPECT_GT(reckoned_m, 1.0);
  EXPECT_LT(fixed_m, 0.6) << "within the follower's capture radius and a little more";
}

TEST(ExitGuidance, UsesNoFixThatItWasNotMadeForOrBeforeItHolds) {
  MapFix fix;
  fix.information.diagonal().setConstant(100.0);
  ExitGuidance without;
  EXPECT_TRUE(without.set_exit_path({}));
  without.begin(0);
  EXPECT_FALSE(without.propose(fix));
  ExitGuidance with({}, estimation::MapFixOptions{});
  EXPECT_TRUE(with.set_exit_path({}));
  EXPECT_FALSE(with.propose(fix)) << "the executive commands";
}

TEST(ExitGuidance, RefusesASigmaThatIsNone) {
  ExitGuidance guidance;
  ExitPath path;
  path.position_sigma_m = -0.1;
  EXPECT_FALSE(guidance.set_exit_path(path));
  path.position_sigma_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(guidance.set_exit_path(path));
}

TEST(ExitGuidance, RefusesAVelocityThatIsNone) {
  ExitGuidance guidance;
  ExitPath path;
  EXPECT_TRUE(guidance.set_exit_path(path));
  path.v_B.y() = 6.0;
  EXPECT_FALSE(guidance.set_exit_path(path));
  path.v_B.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(guidance.set_exit_path(path));
}

}  // namespace
}  // namespace dive::vehicle
