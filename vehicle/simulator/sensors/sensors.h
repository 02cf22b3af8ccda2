#pragma once
// Sensor models on the true state: noise, a heading bias drawn once per dive, and latency.

#include <array>
#include <optional>

#include "common/random.h"
#include "vehicle/simulator/simulator.h"

namespace dive::vehicle {

class Sensors {
 public:
  static constexpr double kMaxLatency = 1.0;  ///< s

  /// `tick` is the time between two calls of sample(), s.
  Sensors(const Conditions& conditions, std::uint64_t seed, double tick);

  /// Records the true motion at `utime` for the IMU, if there is one, before the tick's sample().
  void add_motion(Utime utime, const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& omega_B,
                  const Eigen::Vector3d& specific_force_B);
  [[nodiscard]] const std::optional<InertialUnit>& inertial_unit() const { return unit_; }

  /// Samples the truth at the end of a tick and returns the samples that arrive then, which were
  /// taken one latency before. `specific_force_B` is the specific force at B's origin, m/s^2.
  [[nodiscard]] SensorSamples sample(const GroundTruth& truth,
                                     const Eigen::Vector3d& specific_force_B,
                                     const HealthSample& health);

 private:
  struct Sampled {
    ImuSample imu;
    DepthSample depth;
    InertialSamples inertial;
  };
  static constexpr std::size_t kSlots = 64;

  [[nodiscard]] Eigen::Vector3d noise(double sigma);
  /// Rotation from the true heading to the compass at a place, rad.
  [[nodiscard]] double heading_error(const Eigen::Vector3d& p_W) const;

  Conditions conditions_;
  Random random_;
  double heading_bias_ = 0.0;                                ///< rad
  Eigen::Vector2d heading_phase_ = Eigen::Vector2d::Zero();  ///< Of its variation with place, rad.
  Eigen::Vector3d tilt_bias_ = Eigen::Vector3d::Zero();      ///< rad
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();      ///< rad/s
  double depth_bias_m_ = 0.0;
  std::optional<InertialUnit> unit_;
  InertialSamples imu_of_tick_;  ///< IMU samples of this tick.
  std::size_t latency_ticks_ = 0;
  std::size_t sampled_count_ = 0;
  Utime next_health_ = 0;
  std::array<Sampled, kSlots> sampled_{};
};

}  // namespace dive::vehicle
