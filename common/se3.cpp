#include "common/se3.h"

#include <algorithm>
#include <cmath>

namespace dive {

Pose Pose::operator*(const Pose& other) const {
  return Pose{q * other.p + p, (q * other.q).normalized()};
}

Pose Pose::inverse() const {
  const Eigen::Quaterniond inverse_q = q.conjugate();
  return Pose{-(inverse_q * p), inverse_q};
}

bool Pose::is_finite() const { return p.allFinite() && q.coeffs().allFinite(); }

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  // sin(angle/2)/angle; by its series where the quotient loses digits.
  const double scale = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond result;
  result.w() = std::cos(0.5 * angle);
  result.vec() = scale * rotation_vector;
  return result;
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;  // q and -q are one rotation
  const Eigen::Vector3d vec = sign * rotation.vec();
  const double w = sign * rotation.w();
  const double sine = vec.norm();
  const double scale = sine < 1e-6 ? 2.0 / w * (1.0 - sine * sine / (3.0 * w * w))
                                   : 2.0 * std::atan2(sine, w) / sine;
  return scale * vec;
}

Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d result;
  result << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return result;
}

Pose interpolate(const Pose& a, const Pose& b, double t) {
  if (t <= 0.0) return a;
  if (t >= 1.0) return b;
  return Pose{a.p + t * (b.p - a.p), a.q * so3_exp(t * so3_log(a.q.conjugate() * b.q))};
}

double path_length(std::span<const Pose> poses) {
  double length = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) length += (poses[i].p - poses[i - 1].p).norm();
  return length;
}

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return so3_log(a.conjugate() * b).norm();
}

Eigen::Vector3d to_rpy(const Eigen::Quaterniond& rotation) {
  const Eigen::Matrix3d R = rotation.toRotationMatrix();
  const double pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  if (std::abs(R(2, 0)) > 1.0 - 1e-12) {  // gimbal lock: assign the whole rotation to yaw
    return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  }
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

Eigen::Quaterniond from_rpy(double roll, double pitch, double yaw) {
  // The same to the bit without the sines of zeros: most calls give a heading, some in every tick.
  if (roll == 0.0 && pitch == 0.0) {
    return {std::cos(0.5 * yaw), 0.0, 0.0, std::sin(0.5 * yaw)};
  }
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

Eigen::Quaterniond heading_along(const Eigen::Vector3d& direction, double fallback_yaw) {
  const double horizontal = direction.head<2>().norm();
  const double yaw = horizontal > 1e-9 * direction.norm() ? std::atan2(direction.y(), direction.x())
                                                          : fallback_yaw;
  return from_rpy(0.0, -std::atan2(direction.z(), horizontal), yaw);
}

double wrap_angle(double angle) {
  const double wrapped = std::remainder(angle, 2.0 * M_PI);
  return wrapped <= -M_PI ? M_PI : wrapped;
}

}  // namespace dive
