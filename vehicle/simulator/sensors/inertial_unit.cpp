#include "vehicle/simulator/sensors/inertial_unit.h"

#include <cmath>

#include "common/assert.h"
#include "common/range_check.h"

namespace dive::vehicle {
namespace {

constexpr std::uint64_t kStream = 0x1e47;

}  // namespace

std::string ImuNoise::validate() const {
  RangeCheck check;
  check("gyro_density", gyro_density, 0.0, 0.1);
  check("gyro_walk", gyro_walk, 0.0, 0.1);
  check("accel_density", accel_density, 0.0, 1.0);
  check("accel_walk", accel_walk, 0.0, 1.0);
  check("gyro_bias_sigma", gyro_bias_sigma, 0.0, 1.0);
  check("accel_bias_sigma", accel_bias_sigma, 0.0, 5.0);
  check("scale_sigma", scale_sigma, 0.0, 0.1);
  check("g_sensitivity_sigma", g_sensitivity_sigma, 0.0, 0.01);
  return check.problem();
}

InertialUnit::InertialUnit(const ImuNoise& figures, std::uint64_t seed, double dt)
    : figures_(figures), root_dt_(std::sqrt(dt)), random_(seed, kStream) {
  DIVE_DEMAND(figures.validate().empty() && dt > 0.0);
  gyro_bias_ = figures.gyro_bias_sigma * normal();
  accel_bias_ = figures.accel_bias_sigma * normal();
  gyro_scale_ = Eigen::Matrix3d::Identity() + figures.scale_sigma * normal_matrix();
  accel_scale_ = Eigen::Matrix3d::Identity() + figures.scale_sigma * normal_matrix();
  gyro_by_accel_ = figures.g_sensitivity_sigma * normal_matrix();
}

Eigen::Vector3d InertialUnit::normal() {
  const double x = random_.normal();
  const double y = random_.normal();
  const double z = random_.normal();
  return {x, y, z};
}

Eigen::Matrix3d InertialUnit::normal_matrix() {
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 3; ++i) matrix.col(i) = normal();
  return matrix;
}

void InertialUnit::measure(const Eigen::Vector3d& omega_B, const Eigen::Vector3d& specific_force_B,
                           ImuSample& sample) {
  gyro_bias_ += figures_.gyro_walk * root_dt_ * normal();
  accel_bias_ += figures_.accel_walk * root_dt_ * normal();
  sample.gyro_B = gyro_scale_ * omega_B + gyro_by_accel_ * specific_force_B + gyro_bias_ +
                  figures_.gyro_density / root_dt_ * normal();
  sample.accel_B =
      accel_scale_ * specific_force_B + accel_bias_ + figures_.accel_density / root_dt_ * normal();
}

Eigen::Quaterniond InertialUnit::blurred(const Eigen::Quaterniond& q, double sigma) {
  return (q * so3_exp(sigma * normal())).normalized();
}

}  // namespace dive::vehicle
