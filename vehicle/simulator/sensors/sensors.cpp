#include "vehicle/simulator/sensors/sensors.h"

#include <cmath>

#include "common/assert.h"

namespace dive::vehicle {
namespace {

constexpr std::uint64_t kNoiseStream = 0x5e4503;
constexpr std::uint64_t kBiasStream = 0xb1a5;  // separate: a noise setting must not change the bias

}  // namespace

Sensors::Sensors(const Conditions& conditions, std::uint64_t seed, double tick)
    : conditions_(conditions),
      random_(seed, kNoiseStream),
      latency_ticks_(static_cast<std::size_t>(std::lround(conditions.sensor_latency_s / tick))) {
  DIVE_DEMAND(latency_ticks_ < kSlots);
  Random bias(seed, kBiasStream);
  heading_bias_ = deg_to_rad(conditions.heading_bias_sigma_deg) * bias.normal();
  if (conditions.inertial_unit) {
    unit_.emplace(*conditions.inertial_unit, seed, tick / InertialSamples::kPerTick);
  }
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
  now.imu.q_WB = (from_rpy(0.0, 0.0, heading_bias_) * truth.X_WB.q *
                  so3_exp(noise(deg_to_rad(conditions_.attitude_noise_deg))))
                     .normalized();
  now.imu.gyro_B = truth.omega_WB_B + noise(conditions_.gyro_noise);
  now.imu.accel_B = specific_force_B + noise(conditions_.accel_noise);
  now.depth.utime = truth.utime;
  now.depth.depth_m = -truth.X_WB.p.z() + conditions_.depth_noise_m * random_.normal();
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
