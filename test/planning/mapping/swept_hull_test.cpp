// The way ahead by one scan, compared with rigid motion in steps of a millisecond.

#include "planning/mapping/swept_hull.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "planning/world/primitives.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3d kHalf(0.35, 0.22, 0.07);  // m
constexpr double kSpeed = 0.4;           // m/s

RobotHull box_hull() {
  RobotHull hull;
  ConvexSolid solid;
  for (int corner = 0; corner < 8; ++corner) {
    solid.vertices.emplace_back((corner & 1) != 0 ? kHalf.x() : -kHalf.x(),
                                (corner & 2) != 0 ? kHalf.y() : -kHalf.y(),
                                (corner & 4) != 0 ? kHalf.z() : -kHalf.z());
  }
  hull.parts.push_back(solid);
  return hull;
}

// A square of 0.1 m of points 2 cm apart, perpendicular to the axis.
RangeScan patch(const Vector3d& centre, int axis) {
  RangeScan scan;
  scan.utime = 7;
  for (int i = -2; i <= 2; ++i) {
    for (int k = -2; k <= 2; ++k) {
      Vector3d p = centre;
      p[(axis + 1) % 3] += 0.02 * i;
      p[(axis + 2) % 3] += 0.02 * k;
      scan.points_B.push_back(p.cast<float>());
    }
  }
  return scan;
}

// From an arbitrary place: only the way counts.
std::optional<ObstacleAhead> ahead(const RangeScan& scan, const std::vector<Pose>& way_B,
                                   double speed = kSpeed) {
  const Pose X_WB{Vector3d(30.0, -7.0, -4.0), from_rpy(0.3, -0.2, 2.0)};
  std::vector<Pose> way_W = {X_WB};
  for (const Pose& pose : way_B) way_W.push_back(X_WB * pose);
  return SweptHull(box_hull()).first_obstacle(scan, way_W, speed);
}

std::vector<Pose> straight_to(double x, double y = 0.0) {
  return {Pose{Vector3d(x, y, 0.0), Eigen::Quaterniond::Identity()}};
}

TEST(SweptHull, ReachesAWallAheadWhenTheHullIsWithinTheMargin) {
  const double gap = 0.5;
  const auto obstacle = ahead(patch({kHalf.x() + gap, 0, 0}, 0), straight_to(2.0));
  ASSERT_TRUE(obstacle);
  EXPECT_EQ(obstacle->scan_utime, 7);
  EXPECT_NEAR(obstacle->time_s, (gap - SweptHull::kMargin) / kSpeed, 0.1);
  EXPECT_NEAR(obstacle->p_B.x(), kHalf.x() + gap, 1e-6);
}

TEST(SweptHull, ReachesNothingThatIsFartherThanItSwimsInTheHorizon) {
  const double reach = kSpeed * SweptHull::kHorizon + SweptHull::kMargin;
  EXPECT_FALSE(ahead(patch({kHalf.x() + reach + 0.02, 0, 0}, 0), straight_to(2.0)));
  EXPECT_TRUE(ahead(patch({kHalf.x() + reach - 0.02, 0, 0}, 0), straight_to(2.0)));
}

TEST(SweptHull, PassesAWallBesideIt) {
  for (const double gap : {0.02, 0.04, 0.08}) {
    EXPECT_FALSE(ahead(patch({0.2, kHalf.y() + gap, 0}, 1), straight_to(2.0))) << gap;
  }
}

TEST(SweptHull, ReachesTheWallBesideItOnceItSlidesTowardsIt) {
  for (const double gap : {0.02, 0.04, 0.08}) {
    EXPECT_TRUE(ahead(patch({0.2, kHalf.y() + gap, 0}, 1), straight_to(2.0, 0.3))) << gap;
    EXPECT_FALSE(ahead(patch({0.2, kHalf.y() + gap, 0}, 1), straight_to(2.0, -0.3))) << gap;
  }
}

TEST(SweptHull, ReachesWhatItTurnsInto) {
  const RangeScan beside_the_bow = patch({kHalf.x(), kHalf.y() + 0.2, 0}, 1);
  const auto turn = [](double yaw) {
    return std::vector<Pose>{{Vector3d(0.2, 0.0, 0.0), from_rpy(0, 0, yaw)}};
  };
  EXPECT_TRUE(ahead(beside_the_bow, turn(1.0)));
  EXPECT_FALSE(ahead(beside_the_bow, turn(-1.0)));
}

// On its side it passes where level it would not, and the other way round.
TEST(SweptHull, ReachesWhatItRollsInto) {
  const std::vector<Pose> onto_its_side = {{Vector3d(0.3, 0.0, 0.0), from_rpy(1.5, 0, 0)}};
  EXPECT_TRUE(ahead(patch({0.2, 0.0, 0.16}, 2), onto_its_side));
  EXPECT_FALSE(ahead(patch({0.2, 0.0, 0.16}, 2), straight_to(0.3)));
}

TEST(SweptHull, ReachesNothingAtRestOrWithoutAWay) {
  const RangeScan scan = patch({kHalf.x() + 0.03, 0, 0}, 0);
  EXPECT_FALSE(ahead(scan, straight_to(2.0), 0.0));
  EXPECT_FALSE(ahead(scan, {}));
}

TEST(SweptHull, ReachesNothingBehindTheEndOfItsWay) {
  const RangeScan scan = patch({kHalf.x() + 0.4, 0, 0}, 0);
  EXPECT_TRUE(ahead(scan, straight_to(0.5)));
  EXPECT_FALSE(ahead(scan, straight_to(0.3)));
}

TEST(SweptHull, TakesParticlesAndMissingRangesForNothing) {
  RangeScan scan;
  const float ahead_m = static_cast<float>(kHalf.x()) + 0.3F;
  for (const float y : {-0.15F, 0.0F, 0.15F}) scan.points_B.emplace_back(ahead_m, y, 0.0F);
  for (const float y : {0.01F, 0.02F, 0.03F}) scan.points_B.emplace_back(ahead_m, y, 0.0F);
  scan.points_B.push_back(Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_FALSE(ahead(scan, straight_to(2.0)));
}

TEST(SweptHull, ReachesARopeThatIsThinnerThanAParticle) {
  RangeScan scan;
  for (int i = -10; i <= 10; ++i)
    scan.points_B.emplace_back(0.65F, 0.1F, 0.02F * static_cast<float>(i));
  EXPECT_TRUE(ahead(scan, straight_to(2.0)));
}

TEST(SweptHull, TakesItsOwnHullForNothing) {
  EXPECT_FALSE(ahead(patch({kHalf.x() - 0.01, 0, 0}, 0), straight_to(2.0)));
}

double distance_to_box(const Vector3d& p) { return (p.cwiseAbs() - kHalf).cwiseMax(0.0).norm(); }

// Least distance of p to the box that turns evenly about an axis on a straight way.
double least_distance(const Vector3d& p, const Vector3d& v, const Vector3d& axis, double rate) {
  double least = distance_to_box(p);
  for (int ms = 1; ms <= 1500; ++ms) {
    const double t = 0.001 * ms;
    const Eigen::AngleAxisd turn(rate * t, axis);
    least = std::min(least, distance_to_box(turn.inverse() * (p - t * v)));
  }
  return least;
}

RC_GTEST_PROP(SweptHull, AgreesWithRigidMotionInStepsOfAMillisecond, ()) {
  const auto number = [](double low, double high) {
    return low + (high - low) * *rc::gen::inRange(0, 10'001) / 10'000.0;
  };
  const Vector3d p(number(-1.2, 1.2), number(-0.9, 0.9), number(-0.6, 0.6));
  const Vector3d v(number(0.1, 0.4), number(-0.1, 0.1), number(-0.1, 0.1));
  const Vector3d axis =
      Vector3d(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0) + 2.0).normalized();
  const double rate = number(-0.6, 0.6);
  const RangeScan scan = patch(p, *rc::gen::inRange(0, 3));
  double least = std::numeric_limits<double>::infinity();
  for (const Vector3f& point : scan.points_B) {
    RC_PRE(distance_to_box(point.cast<double>()) > 2.0 * SweptHull::kMargin);
    least = std::min(least, least_distance(point.cast<double>(), v, axis, rate));
  }
  const Eigen::Quaterniond q(Eigen::AngleAxisd(rate * SweptHull::kHorizon, axis));
  const bool is_reached = ahead(scan, {{SweptHull::kHorizon * v, q}}, v.norm()).has_value();
  // Between two steps of 0.1 s the box moves by some centimetres, and may only graze the point.
  if (is_reached) RC_ASSERT(least < SweptHull::kMargin + 0.005);
  if (!is_reached) RC_ASSERT(least > SweptHull::kMargin - 0.04);
}

}  // namespace
}  // namespace dive::planning
