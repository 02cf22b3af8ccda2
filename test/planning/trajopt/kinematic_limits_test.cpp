// Limits of the vehicle's motion: the hinges' values against their definition, their slopes against
// differences.

#include "planning/trajopt/kinematic_limits.h"

#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "test/common/arbitrary.h"
#include "test/planning/reference.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::arbitrary_double;
using testing::arbitrary_vector;
using testing::draw;

std::vector<Hinge> hinges_of(const std::vector<Pose>& path, const KinematicLimits& limits,
                             AttitudeMode mode, bool goal_fixed = false, double reach = 1e6) {
  std::vector<Hinge> hinges;
  add_kinematic_limits(path, limits, mode, goal_fixed, reach, reach, hinges);
  return hinges;
}

std::vector<Pose> arbitrary_path(AttitudeMode mode) {
  std::vector<Pose> path;
  Vector3d at = Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    const double tilt = mode == AttitudeMode::kFree ? 0.5 : 0.0;
    path.push_back({at, from_rpy(tilt * draw(arbitrary_double(-3.0, 3.0)),
                                 tilt * draw(arbitrary_double(-1.0, 1.0)),
                                 draw(arbitrary_double(-0.8, 0.8)))});
    at += Vector3d(0.7, 0.0, 0.0) + draw(arbitrary_vector(0.35));
  }
  return path;
}

KinematicLimits arbitrary_limits() {
  KinematicLimits limits;
  limits.turn_rad_per_m = draw(arbitrary_double(0.2, 3.0));
  limits.max_turn_rad = draw(arbitrary_double(0.2, 2.0));
  limits.max_climb_rad = draw(arbitrary_double(0.2, 1.4));
  limits.max_heading_error_rad = draw(arbitrary_double(0.05, 0.6));
  return limits;
}

TEST(KinematicLimits, SlopesAreThoseOfTheValues) {
  for (const AttitudeMode mode : {AttitudeMode::kFree, AttitudeMode::kHorizontal}) {
    int compared = 0;
    EXPECT_TRUE(rc::check([&] {
      const std::vector<Pose> path = arbitrary_path(mode);
      const KinematicLimits limits = arbitrary_limits();
      const auto at_rest = hinges_of(path, limits, mode);
      const double h = 1e-6;
      for (int waypoint = 0; waypoint < 4; ++waypoint) {
        for (int k = 0; k < 6; ++k) {
          const auto step = [&](double length) {
            std::vector<Pose> moved = path;
            Pose& pose = moved[static_cast<std::size_t>(waypoint)];
            if (k < 3) pose.p[k] += length;
            if (k >= 3) pose.q = pose.q * so3_exp(length * Vector3d::Unit(k - 3));
            return hinges_of(moved, limits, mode);
          };
          const auto ahead = step(h);
          const auto behind = step(-h);
          RC_ASSERT(ahead.size() == at_rest.size());
          for (std::size_t i = 0; i < at_rest.size(); ++i) {
            const int side = waypoint - at_rest[i].block;
            const double slope = side == 0 || side == 1 ? -at_rest[i].a(6 * side + k) : 0.0;
            const double change = (ahead[i].missing - behind[i].missing) / (2.0 * h);
            const double bend = ahead[i].missing + behind[i].missing - 2.0 * at_rest[i].missing;
            if (std::abs(bend) > 1e-8) continue;  // a kink between the two
            ++compared;
            RC_ASSERT(std::abs(change - slope) < 1e-3);
          }
        }
      }
    }));
    EXPECT_GT(compared, 10'000);
  }
}

TEST(KinematicLimits, MatchTheirDefinition) {
  KinematicLimits limits;
  limits.turn_rad_per_m = 0.5;
  limits.max_turn_rad = 1.0;
  limits.max_climb_rad = 0.5;
  limits.max_heading_error_rad = 0.3;
  limits.weight = 10.0;
  const auto costs = [&](const std::vector<Pose>& path, bool goal_fixed = false) {
    double sum = 0.0;
    for (const Hinge& hinge : hinges_of(path, limits, AttitudeMode::kFree, goal_fixed)) {
      sum += hinge.cost();
    }
    return sum;
  };
  const auto along = [](double heading) { return from_rpy(0.0, 0.0, heading); };
  const std::vector<Pose> straight{
      {{0, 0, 0}, along(0)}, {{1, 0, 0}, along(0)}, {{2, 0, 0}, along(0)}};
  EXPECT_EQ(costs(straight), 0.0);

  std::vector<Pose> rolled = straight;
  rolled[2].q = from_rpy(0.8, 0.0, 0.0);  // within one metre, for which the limit is half a radian
  EXPECT_NEAR(costs(rolled), 10.0 * 0.3, 1e-9);
  EXPECT_EQ(costs(rolled, true), 0.0) << "an attitude that was asked for is not its fault";

  std::vector<Pose> across = straight;
  across[1].q = across[2].q = along(0.4);
  EXPECT_NEAR(costs(across), 10.0 * 3 * 0.1, 1e-9) << "0.1 too much: twice at 1, once at 2";

  std::vector<Pose> steep = straight;
  for (std::size_t i = 0; i < 3; ++i) {
    steep[i].p.z() = -static_cast<double>(i);
    steep[i].q = from_rpy(0.0, M_PI / 4, 0.0);
  }
  EXPECT_NEAR(costs(steep), 10.0 * 2 * (1.0 - std::tan(0.5)), 1e-9);
}

TEST(KinematicLimits, WhatAStepCannotBringIntoPlayIsLeftOut) {
  const std::vector<Pose> straight{{{0, 0, 0}, {1, 0, 0, 0}}, {{1, 0, 0}, {1, 0, 0, 0}}};
  EXPECT_TRUE(hinges_of(straight, {}, AttitudeMode::kFree, false, 1e-3).empty());
  EXPECT_FALSE(hinges_of(straight, {}, AttitudeMode::kFree, false, 1.0).empty());
}

}  // namespace
}  // namespace dive::planning
