#include "vehicle/simulator/sensors/sensors.h"

#include <cmath>
#include <numbers>

#include "common/assert.h"
#include "vehicle/simulator/horizontal_draw.h"

namespace dive::vehicle {
namespace {

constexpr std::uint64_t kNoiseStream = 0x5e4503;
constexpr std::uint64_t kBiasStream = 0xb1a5;  // separate: a noise setting must not change the bias
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kSteelLength = 8.0;  // m, of the variation of the heading

}  // namespace

Sensors::Sensors(const Conditions& conditions, std::uint64_t seed, double tick)
    : conditions_(conditions),
      random_(seed, kNoiseStream),
      latency_ticks_(static_cast<std::size_t>(std::lround(conditions.sensor_latency_s / tick))) {
  DIVE_DEMAND(latency_ticks_ < kSlots);
  Random bias(seed, kBiasStream);
  heading_bias_ = deg_to_rad(conditions.heading_bias_sigma_deg) * bias.normal();
  heading_phase_ = {bias.uniform(0.0, kTurn), bias.uniform(0.0, kTurn)};
  tilt_bias_ = horizontal_draw(bias, deg_to_rad(conditions.tilt_bias_sigma_deg));
  for (double& axis : gyro_bias_) axis = conditions.gyro_bias_sigma * bias.normal();
  depth_bias_m_ = conditions.depth_bias_sigma_m * bias.normal();
  if (conditions.inertial_unit) {
    unit_.emplace(*conditions.inertial_unit, seed, tick / InertialSamples::kPerTick);
  }
}

// Steel bends the field over some metres.
double Sensors::heading_error(const Eigen::Vector3d& p_W) const {
  const Eigen::Vector2d phase = kTurn / kSteelLength * p_W.head<2>() + heading_phase_;
  return heading_bias_ + deg_to_rad(conditions_.heading_variation_deg) *
                             (std::sin(phase.x()) + std::sin(phase.y()));
}

Eigen::Vector3d Sensors::noise(double sigma) {
  const double x = random_.normal();
  const double y = random_.normal();
  const double z = random_.normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

void Sensors::add_motion(Utime utime, const Eigen::Quaterniond& q_WB,
                         const Eigen::Vector3d& omega_B, const Eigen::Vector3d& specific_force_B) {
  DIVE_DEMAND(unit_ && imu_of_tick_.count < imu_of_tick_.samples.size());
  ImuSample& sample = imu_of_tick_.samples[imu_of_tick_.count++];
  sample.utime = utime;
  sample.q_WB = unit_->blurred(from_rpy(0.0, 0.0, heading_bias_) * q_WB,
                               deg_to_rad(conditions_.attitude_noise_deg));
  unit_->measure(omega_B, specific_force_B, sample);
}

SensorSamples Sensors::sample(const GroundTruth& truth, const Eigen::Vector3d& specific_force_B,
                              const HealthSample& health) {
  Sampled& now = sampled_[sampled_count_ % kSlots];
  now.imu.utime = truth.utime;
  now.imu.q_WB = (from_rpy(0.0, 0.0, heading_error(truth.X_WB.p)) * truth.X_WB.q *
                  so3_exp(tilt_bias_) * so3_exp(noise(deg_to_rad(conditions_.attitude_noise_deg))))
                     .normalized();
  now.imu.gyro_B = truth.omega_WB_B + gyro_bias_ + noise(conditions_.gyro_noise);
  now.imu.accel_B = specific_force_B + noise(conditions_.accel_noise);
  now.depth.utime = truth.utime;
  now.depth.depth_m =
      -truth.X_WB.p.z() + depth_bias_m_ + conditions_.depth_noise_m * random_.normal();
  now.inertial = imu_of_tick_;
  imu_of_tick_.count = 0;
  ++sampled_count_;

  SensorSamples arriving;
  if (sampled_count_ > latency_ticks_) {
    const Sampled& then = sampled_[(sampled_count_ - 1 - latency_ticks_) % kSlots];
    arriving.imu = then.imu;
    arriving.depth = then.depth;
    arriving.inertial = then.inertial;
  }
  if (truth.utime >= next_health_) {
    arriving.health = health;
    next_health_ = truth.utime + kMicrosecondsPerSecond;
  }
  return arriving;
}

}  // namespace dive::vehicle
