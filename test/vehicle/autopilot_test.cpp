#include "vehicle/autopilot.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "common/assert.h"
#include "test/common/allocations.h"
#include "test/common/arbitrary.h"
#include "test/vehicle/aqua2.h"

namespace dive::vehicle {
namespace {

using Eigen::Vector3d;
using testing::aqua2;

// The vehicle under its autopilot, by default in pool conditions.
struct Flight {
  explicit Flight(const Conditions& conditions = {},
                  const Pose& start = {{0.0, 0.0, -5.0}, Eigen::Quaterniond::Identity()},
                  std::uint64_t seed = 3)
      : sim(aqua2(), start, conditions, seed) {
    command.d = -start.p.z();
    command.o = start.q;
  }

  void fly(double seconds) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds / Simulator::kTick)); ++i) tick();
  }
  void tick() {
    const SensorSamples samples = sim.step(rates);
    if (!samples.imu) return;
    rates = autopilot.step(command, samples.imu->q_WB, samples.imu->gyro_B, samples.depth->depth_m,
                           Simulator::kTick);
  }
  [[nodiscard]] double depth() const { return -sim.truth().X_WB.p.z(); }
  [[nodiscard]] double yaw_deg() const { return rad_to_deg(to_rpy(sim.truth().X_WB.q).z()); }

  Simulator sim;
  Autopilot autopilot{AutopilotOptions{}};
  Command command;
  PseudoRates rates;
};

class AtSpeed : public ::testing::TestWithParam<double> {};

TEST_P(AtSpeed, TurnsNinetyDegreesInThreeSecondsWithoutSwinging) {
  Flight flight;
  flight.command.v = GetParam();
  flight.fly(15.0);
  flight.command.o = from_rpy(0.0, 0.0, deg_to_rad(90.0));
  double most = 0.0;
  for (int i = 0; i < 200; ++i) {
    flight.tick();
    most = std::max(most, flight.yaw_deg());
  }
  EXPECT_LT(most, 90.0 + 5.0);
  for (int i = 0; i < 500; ++i) {
    flight.tick();
    ASSERT_NEAR(flight.yaw_deg(), 90.0, 3.0) << "4 s after the command and later";
  }
}

TEST_P(AtSpeed, ChangesDepthByAMetreWithoutOvershoot) {
  Flight flight;
  flight.command.v = GetParam();
  flight.fly(15.0);
  flight.command.d = 6.0;
  double deepest = 0.0;
  for (int i = 0; i < 1000; ++i) {
    flight.tick();
    deepest = std::max(deepest, flight.depth());
  }
  EXPECT_LT(deepest, 6.0 + 0.05);
  EXPECT_NEAR(flight.depth(), 6.0, 0.05) << "20 s after the command";
}

TEST_P(AtSpeed, HoldsDepthAndSpeed) {
  Conditions conditions;
  conditions.speed_scale_sigma = 0.0;
  conditions.hull_scatter = 0.0;
  conditions.depth_bias_sigma_m = 0.0;
  Flight flight(conditions);
  flight.command.v = GetParam();
  flight.fly(20.0);
  EXPECT_NEAR(flight.sim.truth().v_WB_B.x(), GetParam(), 0.01);
  for (int i = 0; i < 1000; ++i) {
    flight.tick();
    ASSERT_NEAR(flight.depth(), 5.0, 0.05);
    ASSERT_LT(angle_between(flight.sim.truth().X_WB.q, flight.command.o), deg_to_rad(3.0));
  }
}

INSTANTIATE_TEST_SUITE_P(Speeds, AtSpeed, ::testing::Values(0.0, 0.2, 0.4, 0.6, 0.8));

TEST(Autopilot, FollowsADepthThatMovesWithoutLag) {
  Flight flight;
  flight.command.v = 0.4;
  flight.fly(10.0);
  for (int i = 0; i < 750; ++i) {
    flight.command.d += 0.1 * Simulator::kTick;
    flight.tick();
    if (i < 250) continue;
    ASSERT_NEAR(flight.depth(), flight.command.d, 0.05);
  }
}

TEST(Autopilot, HoldsDepthInAnyPose) {
  for (const Vector3d& rpy : {Vector3d(0.0, 0.7, 0.0), Vector3d(0.0, -1.5, 1.0),
                              Vector3d(1.2, 0.0, 0.0), Vector3d(0.0, 1.5, 0.0)}) {
    Flight flight({}, {{0.0, 0.0, -5.0}, from_rpy(rpy.x(), rpy.y(), rpy.z())});
    if (rpy.x() != 0.0) flight.command.v = 0.3;  // rolled: depth by the nose needs speed
    if (rpy.x() == 0.0) flight.fly(40.0);
    flight.fly(20.0);
    EXPECT_NEAR(flight.depth(), 5.0, 0.15) << rpy.transpose();
    EXPECT_LT(angle_between(flight.sim.truth().X_WB.q, flight.command.o), deg_to_rad(15.0))
        << rpy.transpose();
  }
}

// No two vehicles have the same thrust and the same righting moment.
TEST(Autopilot, HoldsItsSideWithAnyHull) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Flight flight({}, {{0.0, 0.0, -5.0}, Eigen::Quaterniond::Identity()}, seed);
    flight.command.v = 0.4;
    flight.fly(3.0);
    flight.command.o = from_rpy(deg_to_rad(90.0), 0.0, 0.0);
    flight.fly(8.0);
    EXPECT_NEAR(rad_to_deg(to_rpy(flight.sim.truth().X_WB.q).x()), 90.0, 5.0) << seed;
  }
}

// Behind on a steep climb, heave would turn the nose down with more than the flippers' moment, and
// the vehicle would leave its path level.
TEST(Autopilot, LiftsItsNoseBeforeItHeavesWithAnyHull) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Conditions conditions;
    conditions.hull_scatter = 0.2;
    Flight flight(conditions, {{0.0, 0.0, -20.0}, Eigen::Quaterniond::Identity()}, seed);
    flight.command.v = 0.4;
    flight.fly(10.0);
    flight.command.o = from_rpy(0.0, deg_to_rad(-50.0), 0.0);
    flight.command.d = flight.depth() - 0.5;
    for (int i = 0; i < 500; ++i) {
      flight.command.d -= 0.3 * Simulator::kTick;
      flight.tick();
    }
    EXPECT_LT(rad_to_deg(to_rpy(flight.sim.truth().X_WB.q).y()), -40.0) << "hull " << seed;
  }
}

// On its side the flippers have no vertical thrust; surge would drive it astern.
TEST(Autopilot, ThatHangsOnItsSideDoesNotSlideAway) {
  Flight flight({}, {{0.0, 0.0, -5.0}, from_rpy(1.3, -0.37, 0.0)});
  flight.command.d = 5.5;
  flight.command.v = 0.05;
  for (int i = 0; i < 600; ++i) {
    flight.tick();
    ASSERT_GT(flight.sim.truth().v_WB_B.x(), -0.15) << i;
  }
}

TEST(Autopilot, TurnsOverThroughTheGimbalLockOfEulerAngles) {
  Flight flight;
  flight.command.o = from_rpy(0.0, deg_to_rad(150.0), 0.0);
  flight.fly(25.0);
  EXPECT_LT(angle_between(flight.sim.truth().X_WB.q, flight.command.o), deg_to_rad(5.0));
}

TEST(Autopilot, CannotSwimOutOfTheWater) {
  Flight flight;
  flight.command = {0.8, 0.0, -5.0, from_rpy(0.0, deg_to_rad(-60.0), 0.0)};
  double highest = -5.0;
  for (int i = 0; i < 2000; ++i) {
    flight.tick();
    highest = std::max(highest, -flight.depth());
  }
  EXPECT_GT(highest, -0.4) << "it did reach the surface";
  EXPECT_LT(highest, 0.3) << "and its middle never left the water by more than half its length";
}

RC_GTEST_PROP(Autopilot, AnswersAnythingMeasuredWithinItsLimits, ()) {
  Autopilot autopilot{AutopilotOptions{}};
  for (int i = 0; i < 5; ++i) {
    Command command;
    command.v = *testing::arbitrary_double(-2.0, 2.0);
    command.d = *testing::arbitrary_double(-10.0, 100.0);
    command.o = (*testing::arbitrary_pose()).q;
    const PseudoRates rates =
        autopilot.step(command, (*testing::arbitrary_pose()).q, *testing::arbitrary_vector(10.0),
                       *testing::arbitrary_double(-1.0, 100.0), 0.02);
    for (const double rate : {rates.surge, rates.heave, rates.roll, rates.pitch, rates.yaw}) {
      RC_ASSERT(rate >= -1.0 && rate <= 1.0);
    }
  }
}

TEST(Autopilot, AllocatesNothing) {
  Autopilot autopilot{AutopilotOptions{}};
  testing::reset_allocations();
  static_cast<void>(autopilot.step({}, from_rpy(0.1, 0.2, 0.3), Vector3d::Ones(), 3.0, 0.02));
  EXPECT_EQ(testing::allocations().count, 0U);
}

TEST(Autopilot, DemandsNumbers) {
  Autopilot autopilot{AutopilotOptions{}};
  const Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  EXPECT_THROW(static_cast<void>(autopilot.step({}, q, Vector3d::Zero(), std::nan(""), 0.02)),
               AssertionFailure);
  EXPECT_THROW(static_cast<void>(autopilot.step({}, q, Vector3d::Zero(), 1.0, 0.0)),
               AssertionFailure);
  AutopilotOptions options;
  options.depth_p = -1.0;
  EXPECT_THAT(options.validate(), ::testing::StartsWith("depth_p"));
  EXPECT_THROW(Autopilot{options}, AssertionFailure);
}

}  // namespace
}  // namespace dive::vehicle
