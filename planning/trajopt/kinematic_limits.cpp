#include "planning/trajopt/kinematic_limits.h"

#include <algorithm>
#include <cmath>

#include "planning/trajopt/smooth_costs.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

constexpr double kStill = 1e-6;  // m or rad: smaller motions have no direction to differentiate by

// |log(q_a^-1 q_b)| grows by u . (theta_b - theta_a), where u is the axis of both steps.
Hinge turn_hinge(int i, const Pose& a, const Pose& b, const KinematicLimits& limits) {
  const Vector3d turn = so3_log(a.q.conjugate() * b.q);
  const double angle = turn.norm();
  const Vector3d motion = b.p - a.p;
  const double by_motion = limits.turn_rad_per_m * motion.norm();
  const double allowed = std::min(limits.max_turn_rad, by_motion);
  Hinge hinge{.block = i, .missing = angle - allowed, .weight = limits.weight};
  if (angle < kStill) return hinge;
  hinge.a.segment<3>(3) = turn / angle;
  hinge.a.segment<3>(9) = -turn / angle;
  if (by_motion < limits.max_turn_rad && motion.norm() > kStill) {
    hinge.a.segment<3>(6) = limits.turn_rad_per_m * motion.normalized();
    hinge.a.head<3>() = -hinge.a.segment<3>(6);
  }
  return hinge;
}

// |dz| <= tan(max_climb) * horizontal distance.
Hinge climb_hinge(int i, const Pose& a, const Pose& b, const KinematicLimits& limits) {
  const Vector3d motion = b.p - a.p;
  const double flat = motion.head<2>().norm();
  const double slope = std::tan(limits.max_climb_rad);
  Hinge hinge{.block = i, .missing = std::abs(motion.z()) - slope * flat, .weight = limits.weight};
  Vector3d less;  // direction in which the excess decreases
  less << (flat > kStill ? Eigen::Vector2d(slope * motion.head<2>() / flat)
                         : Eigen::Vector2d(slope, 0.0)),
      motion.z() > 0.0 ? -1.0 : 1.0;
  hinge.a.head<3>() = -less;
  hinge.a.segment<3>(6) = less;
  return hinge;
}

// The angle between the body's x axis at waypoint `which` (0: i, 1: i + 1) and the motion.
Hinge heading_hinge(int i, const Pose& a, const Pose& b, int which, AttitudeMode attitude,
                    const KinematicLimits& limits) {
  Eigen::Matrix<double, 2, 12> J;
  const Eigen::Vector2d error = heading_error_model(a, b, which, attitude, J);
  const double angle = error.norm();
  Hinge hinge{.block = i, .missing = angle - limits.max_heading_error_rad, .weight = limits.weight};
  if (angle > kStill) hinge.a = -(J.transpose() * error) / angle;
  return hinge;
}

}  // namespace

void add_kinematic_limits(std::span<const Pose> path, const KinematicLimits& limits,
                          AttitudeMode attitude, bool goal_attitude_fixed, double reach_m,
                          double reach_rad, std::vector<Hinge>& out) {
  const auto last = static_cast<int>(path.size()) - 1;
  const auto add = [&](const Hinge& hinge) {
    const double reach =
        reach_m * (hinge.a.head<3>().lpNorm<1>() + hinge.a.segment<3>(6).lpNorm<1>()) +
        reach_rad * (hinge.a.segment<3>(3).lpNorm<1>() + hinge.a.tail<3>().lpNorm<1>());
    if (hinge.missing > -reach) out.push_back(hinge);
  };
  for (int i = 0; i < last; ++i) {
    const Pose& a = path[static_cast<std::size_t>(i)];
    const Pose& b = path[static_cast<std::size_t>(i) + 1];
    const bool to_given = i + 1 == last && goal_attitude_fixed;
    if (i > 0 && !to_given) add(turn_hinge(i, a, b, limits));
    add(climb_hinge(i, a, b, limits));
    if (i > 0) add(heading_hinge(i, a, b, 0, attitude, limits));
    if (!to_given) add(heading_hinge(i, a, b, 1, attitude, limits));
  }
}

}  // namespace dive::planning
