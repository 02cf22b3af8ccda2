#pragma once
// Rigid poses. World W is ENU with z up and z = 0 at the surface; body B is x forward, y left,
// z up. Hamilton quaternions. Formulas: J. Solà, J. Deray, D. Atchuthan, "A micro Lie theory for
// state estimation in robotics", arXiv:1812.01537 (equation numbers below are theirs).

#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dive {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Pose of a frame B in a frame A: p_A = q_AB * p_B + p_AB.
struct Pose {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();            ///< Position, m.
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();  ///< Attitude, unit.

  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return q * point + p;
  }
  [[nodiscard]] Pose operator*(const Pose& other) const;
  [[nodiscard]] Pose inverse() const;
  [[nodiscard]] bool is_finite() const;
};

/// Rotation vector (rad) to unit quaternion, exact to rounding at tiny angles (eq. 101).
[[nodiscard]] Eigen::Quaterniond so3_exp(const Eigen::Vector3d& rotation_vector);

/// Unit quaternion to the rotation vector of norm <= pi (eq. 103).
[[nodiscard]] Eigen::Vector3d so3_log(const Eigen::Quaterniond& rotation);

/// Skew-symmetric matrix: skew(a) b = a x b.
[[nodiscard]] Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// Interpolates position linearly and attitude along the shorter great arc: the motion that the
/// follower swims and the certificate covers. Exact at the ends: t = 0 is a, t = 1 is b.
[[nodiscard]] Pose interpolate(const Pose& a, const Pose& b, double t);

/// Length of the polyline through the positions of `poses`, m.
[[nodiscard]] double path_length(std::span<const Pose> poses);

/// Angle of the rotation that takes a to b, in [0, pi] rad.
[[nodiscard]] double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

/// Roll, pitch, yaw (rad) of R = Rz(yaw) Ry(pitch) Rx(roll). In ENU with x forward and y left,
/// positive pitch is nose *down*; yaw is counter-clockwise from east.
[[nodiscard]] Eigen::Vector3d to_rpy(const Eigen::Quaterniond& rotation);
[[nodiscard]] Eigen::Quaterniond from_rpy(double roll, double pitch, double yaw);

/// Attitude whose x axis points along `direction` (not zero), with roll zero. Straight up or down
/// keeps `fallback_yaw` (rad).
[[nodiscard]] Eigen::Quaterniond heading_along(const Eigen::Vector3d& direction,
                                               double fallback_yaw = 0.0);

/// Wraps an angle (rad) to (-pi, pi].
[[nodiscard]] double wrap_angle(double angle);

[[nodiscard]] constexpr double deg_to_rad(double degrees) { return degrees * 0.017453292519943295; }
[[nodiscard]] constexpr double rad_to_deg(double radians) { return radians * 57.29577951308232; }

}  // namespace dive
