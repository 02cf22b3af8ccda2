// The smooth costs and their models: the optimiser's gradient must be the slope of the cost.

#include "planning/trajopt/smooth_costs.h"

#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "test/common/arbitrary.h"
#include "test/planning/reference.h"

namespace dive::planning {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::arbitrary_double;
using testing::arbitrary_rotation_vector;
using testing::arbitrary_vector;
using testing::draw;
using testing::still;

// Waypoints a metre or two apart; attitudes within 2 rad of the motion, any roll.
std::vector<Pose> arbitrary_path() {
  std::vector<Pose> path;
  Vector3d at = draw(arbitrary_vector(5.0));
  const int count = draw(rc::gen::inRange(2, 7));
  for (int i = 0; i < count; ++i) {
    const Vector3d off = draw(arbitrary_vector(0.6));
    path.push_back({at, so3_exp(off) * from_rpy(draw(arbitrary_double(-3.0, 3.0)), 0.0, 0.0)});
    at += Vector3d(1.5, 0.0, 0.0) + draw(arbitrary_vector(0.4));
  }
  const Eigen::Quaterniond turn = so3_exp(draw(arbitrary_rotation_vector()));
  for (Pose& pose : path) pose = Pose{turn * pose.p, turn * pose.q};
  return path;
}

std::vector<Pose> moved(std::vector<Pose> path, int waypoint, const Vector6d& step) {
  Pose& pose = path[static_cast<std::size_t>(waypoint)];
  pose.p += step.head<3>();
  pose.q = pose.q * so3_exp(step.tail<3>());
  return path;
}

SmoothCosts arbitrary_costs(AttitudeMode mode) {
  SmoothCosts costs;
  costs.length_weight = draw(arbitrary_double(0.0, 100.0));
  costs.attitude_weight = draw(arbitrary_double(0.0, 50.0));
  costs.turn_weight = draw(arbitrary_double(0.0, 50.0));
  costs.reference_length = draw(arbitrary_double(1.0, 20.0));
  costs.attitude = mode;
  return costs;
}

double longest_way_of(const std::vector<Pose>& path, AttitudeMode mode) {
  double least = 1e300;
  for (std::size_t i = 1; i < path.size(); ++i) {
    Vector3d way = path[i].p - path[i - 1].p;
    if (mode == AttitudeMode::kHorizontal) way.z() = 0.0;
    least = std::min(least, way.norm());
  }
  return least;
}

TEST(SmoothCosts, ModelHasTheSlopeOfTheValue) {
  for (const AttitudeMode mode : {AttitudeMode::kFree, AttitudeMode::kHorizontal}) {
    int compared = 0;
    EXPECT_TRUE(rc::check([&] {
      std::vector<Pose> path = arbitrary_path();
      if (mode == AttitudeMode::kHorizontal) {
        for (Pose& pose : path) pose.q = from_rpy(0.0, 0.0, to_rpy(pose.q).z());
      }
      const SmoothCosts costs = arbitrary_costs(mode);
      // the angles have a kink at backward motion
      for (std::size_t i = 0; i + 1 < path.size(); ++i) {
        if (angle_between(path[i].q, path[i + 1].q) > 3.0) return;
        for (const Pose& pose : {path[i], path[i + 1]}) {
          if (heading_error(pose.q, path[i + 1].p - path[i].p, mode).norm() > 3.0) return;
        }
      }
      if (longest_way_of(path, mode) < 0.3) return;  // without motion the heading has no slope
      ++compared;
      BandedQp qp(static_cast<int>(path.size()), 0);
      qp.reset(static_cast<int>(path.size()));
      costs.add_to(path, qp);
      const double h = 1e-5;
      for (int i = 0; i < static_cast<int>(path.size()); ++i) {
        for (int k = 0; k < 6; ++k) {
          const double ahead = costs.value(moved(path, i, h * Vector6d::Unit(k)));
          const double behind = costs.value(moved(path, i, -h * Vector6d::Unit(k)));
          RC_ASSERT(std::abs(qp.gradient(i)(k) - (ahead - behind) / (2.0 * h)) <
                    1e-5 * (1.0 + costs.value(path)));
        }
      }
    }));
    EXPECT_GT(compared, 30);
  }
}

TEST(SmoothCosts, LengthModelIsExactForAnyStep) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<Pose> path = arbitrary_path();
    SmoothCosts costs = arbitrary_costs(AttitudeMode::kFree);
    costs.attitude_weight = costs.turn_weight = 0.0;
    const auto n = static_cast<int>(path.size());
    BandedQp qp(n, 0);
    qp.reset(n);
    costs.add_to(path, qp);
    std::vector<Vector6d> steps(path.size(), Vector6d::Zero());
    std::vector<Pose> there = path;
    for (std::size_t i = 0; i < path.size(); ++i) {
      steps[i].head<3>() = draw(arbitrary_vector(2.0));
      there[i].p += steps[i].head<3>();
    }
    double model = costs.value(path);
    for (int i = 0; i < n; ++i) {
      const Vector6d& step = steps[static_cast<std::size_t>(i)];
      const Vector6d Hx =
          qp.hessian().multiply_row(i, [&](int j) { return steps[static_cast<std::size_t>(j)]; });
      model += step.dot(0.5 * Hx + qp.gradient(i));
    }
    RC_ASSERT(std::abs(model - costs.value(there)) < 1e-9 * (1.0 + std::abs(model)));
  }));
}

TEST(SmoothCosts, LengthTermIsNeverBelowTheLengthAndEqualsItOnEvenPaths) {
  SmoothCosts costs{.length_weight = 100.0, .attitude_weight = 0.0, .turn_weight = 0.0};
  EXPECT_TRUE(rc::check([&] {
    const std::vector<Pose> path = arbitrary_path();
    double length = 0.0;
    for (std::size_t i = 1; i < path.size(); ++i) length += (path[i].p - path[i - 1].p).norm();
    for (const double about : {0.3 * length, length, 4.0 * length, 1.0}) {
      costs.reference_length = about;
      RC_ASSERT(costs.value(path) >= 100.0 * length * (1.0 - 1e-12));
    }
  }));
  std::vector<Pose> even;  // a zigzag of steps of 0.5 m
  for (int i = 0; i < 8; ++i) even.push_back(still({0.4 * i, i % 2 == 0 ? 0.0 : 0.3, -4.0}));
  costs.reference_length = 3.5;
  EXPECT_NEAR(costs.value(even), 350.0, 1e-9);
  even[3].p.x() += 0.1;
  EXPECT_GT(costs.value(even), 350.0);
}

TEST(HeadingError, IsTheAngleBetweenTheXAxisAndTheMotion) {
  EXPECT_TRUE(rc::check([] {
    const Eigen::Quaterniond q = so3_exp(draw(arbitrary_rotation_vector()));
    const Vector3d way = draw(arbitrary_vector(3.0)) + Vector3d(0.0, 0.0, 0.01);
    const Vector3d x = q * Vector3d::UnitX();
    const double angle = std::atan2(x.cross(way).norm(), x.dot(way));
    const Vector2d error = heading_error(q, way, AttitudeMode::kFree);
    RC_ASSERT(std::abs(error.norm() - angle) < 1e-6);
    // Turning by it, about z for y and about -y for z, points the x axis along the motion.
    const Vector3d turned = q * (so3_exp(Vector3d(0.0, -error.y(), error.x())) * Vector3d::UnitX());
    RC_ASSERT((turned - way.normalized()).norm() < 1e-6);
  }));
}

TEST(HeadingError, CountsOnlyTheHeadingOfAHorizontalVehicle) {
  const Eigen::Quaterniond east = Eigen::Quaterniond::Identity();
  const Vector3d steep(1.0, 1.0, -5.0);
  EXPECT_NEAR(
      (heading_error(east, steep, AttitudeMode::kHorizontal) - Vector2d(M_PI / 4, 0)).norm(), 0.0,
      1e-12);
  EXPECT_GT(heading_error(east, steep, AttitudeMode::kFree).norm(), 1.2);
  for (const AttitudeMode mode : {AttitudeMode::kFree, AttitudeMode::kHorizontal}) {
    EXPECT_EQ(heading_error(east, Vector3d::Zero(), mode), Vector2d(0, 0));
    EXPECT_EQ(heading_error(east, -Vector3d::UnitX(), mode), Vector2d(M_PI, 0));
  }
  EXPECT_EQ(heading_error(east, Vector3d(0, 0, -2.0), AttitudeMode::kHorizontal), Vector2d(0, 0));
}

}  // namespace
}  // namespace dive::planning
