// The declared current in time, and the speed that it leaves over ground.

#include "common/declared_current.h"

#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/ground_speed.h"

namespace dive {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

DeclaredCurrent turning_tide() {
  return DeclaredCurrent({{-600.0, Vector2d(0.1, 0.0)},
                          {0.0, Vector2d(0.1, 0.0)},
                          {100.0, Vector2d(-0.1, 0.2)},
                          {400.0, Vector2d(-0.1, 0.0)}});
}

TEST(DeclaredCurrent, FlowsTowardsItsCompassHeading) {
  EXPECT_LT((flow_towards(0.2, 0.0) - Vector2d(0.0, 0.2)).norm(), 1e-12) << "north";
  EXPECT_LT((flow_towards(0.2, 90.0) - Vector2d(0.2, 0.0)).norm(), 1e-12) << "east";
  EXPECT_LT((flow_towards(0.2, 225.0) + Vector2d(0.2, 0.2) / std::sqrt(2.0)).norm(), 1e-12);
}

TEST(DeclaredCurrent, InterpolatesTheVectorAndHoldsItsEnds) {
  const DeclaredCurrent tide = turning_tide();
  EXPECT_EQ(tide.at(-1e6), Vector2d(0.1, 0.0));
  EXPECT_LT((tide.at(50.0) - Vector2d(0.0, 0.1)).norm(), 1e-12) << "slower, not only turned";
  EXPECT_LT((tide.at(100.0) - Vector2d(-0.1, 0.2)).norm(), 1e-12);
  EXPECT_LT((tide.at(325.0) - Vector2d(-0.1, 0.05)).norm(), 1e-12);
  EXPECT_EQ(tide.at(1e6), Vector2d(-0.1, 0.0));
  EXPECT_TRUE(tide.covers(-600.0, 400.0));
  EXPECT_FALSE(tide.covers(-600.5, 0.0));
  EXPECT_FALSE(tide.covers(0.0, 400.5));
}

TEST(DeclaredCurrent, OfAConstantIsTheSameAtAllTimes) {
  const DeclaredCurrent constant(Vector2d(0.0, -0.3));
  EXPECT_EQ(constant.at(-5.0), Vector2d(0.0, -0.3));
  EXPECT_EQ(constant.at(5e4), Vector2d(0.0, -0.3));
  EXPECT_TRUE(constant.covers(-1e9, 1e9));
  EXPECT_FALSE(constant.is_still());
  EXPECT_TRUE(DeclaredCurrent().is_still());
  EXPECT_EQ(DeclaredCurrent().at(7.0), Vector2d::Zero());
}

TEST(DeclaredCurrent, ContinuesInTheTimeOfARestart) {
  const DeclaredCurrent tide = turning_tide();
  const DeclaredCurrent later = tide.from(75.0);
  for (const double t : {-100.0, 0.0, 10.0, 60.0, 300.0, 1000.0}) {
    EXPECT_LT((later.at(t) - tide.at(75.0 + t)).norm(), 1e-12) << t;
  }
}

TEST(DeclaredCurrent, DemandsSamplesInOrderAndCurrentsOfThisWorld) {
  using Samples = std::vector<DeclaredCurrent::Sample>;
  EXPECT_ANY_THROW(DeclaredCurrent(Samples{{0.0, Vector2d::Zero()}}));
  EXPECT_ANY_THROW(DeclaredCurrent(Samples{{1.0, Vector2d::Zero()}, {1.0, Vector2d::Zero()}}));
  EXPECT_ANY_THROW(DeclaredCurrent(Vector2d(4.0, 0.0)));
}

// g e - u has the length V: what remains after the current is what the vehicle swims.
RC_GTEST_PROP(SpeedOverGround, IsThatOfAVehicleThatSwimsWithItsSpeedThroughTheWater, ()) {
  const auto from = [](int low, int high) { return *rc::gen::inRange(low, high) / 1000.0; };
  const double speed = from(50, 1000);
  const Vector2d current(from(-900, 900), from(-900, 900));
  Vector3d direction(from(-1000, 1000), from(-1000, 1000), from(-1000, 1000));
  RC_PRE(direction.norm() > 0.01);
  direction.normalize();
  const Vector3d flow(current.x(), current.y(), 0.0);
  const auto over_ground = speed_over_ground(direction, speed, current);
  const double across = (flow - flow.dot(direction) * direction).norm();
  RC_ASSERT(over_ground.has_value() == (across <= speed) || std::abs(across - speed) < 1e-9);
  if (!over_ground) return;
  RC_ASSERT(std::abs((*over_ground * direction - flow).norm() - speed) < 1e-9);
  RC_ASSERT(*over_ground >= flow.dot(direction) - 1e-12);  // and never backwards through the water
}

TEST(SpeedOverGround, GivesTheTimeOfAPathThereAndBack) {
  const Vector3d a(0.0, 0.0, -2.0);
  const Vector3d b(12.0, 0.0, -2.0);
  EXPECT_DOUBLE_EQ(swim_time_s(a, b, 0.4, Vector2d::Zero()), 30.0);
  EXPECT_NEAR(swim_time_s(a, b, 0.4, Vector2d(0.1, 0.0)), 24.0, 1e-9);
  EXPECT_NEAR(swim_time_s(b, a, 0.4, Vector2d(0.1, 0.0)), 40.0, 1e-9);
  EXPECT_NEAR(swim_time_s(a, b, 0.5, Vector2d(0.0, 0.3)), 30.0, 1e-9) << "3 : 4 : 5";
  EXPECT_NEAR(swim_time_s(b, a, 0.4, Vector2d(0.5, 0.0)), 12.0 / 0.02, 1e-9) << "bounded";
}

}  // namespace
}  // namespace dive
