#pragma once
// An IMU at B's origin at 200 Hz: white noise, and biases as random walks.
//
//   gyro = omega + b_g + n_g,  accel = f + b_a + n_a,  b' = walk
//
// sampled as usual (Woodman 2007, "An introduction to inertial navigation"; the model of Kalibr and
// of the EuRoC data): over dt the noise has the standard deviation density / sqrt(dt), a step of
// the bias walk * sqrt(dt).

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/measurements.h"
#include "common/random.h"
#include "common/se3.h"

namespace dive::vehicle {

/// Noise per axis. The densities are those of the data sheet of a MicroStrain 3DM-GX4-25 (0.005
/// deg/s/sqrt(Hz), 100 ug/sqrt(Hz)), which gives no random walks: with these the biases exceed its
/// stated stability (10 deg/h, 0.04 mg) within a minute or two.
struct ImuNoise {
  double gyro_density = 8.7e-5;    ///< rad/s/sqrt(Hz).
  double gyro_walk = 5e-6;         ///< rad/s^2/sqrt(Hz).
  double accel_density = 9.8e-4;   ///< m/s^2/sqrt(Hz).
  double accel_walk = 4e-5;        ///< m/s^3/sqrt(Hz).
  double gyro_bias_sigma = 9e-4;   ///< Initial gyro bias, rad/s: 0.05 deg/s.
  double accel_bias_sigma = 0.02;  ///< Initial accelerometer bias, m/s^2: 2 mg.

  /// A description of the first error; empty if the figures are usable.
  [[nodiscard]] std::string validate() const;
};

/// The samples of one control tick, oldest first.
struct InertialSamples {
  static constexpr int kPerTick = 4;

  std::array<ImuSample, kPerTick> samples{};
  std::size_t count = 0;

  [[nodiscard]] std::span<const ImuSample> list() const { return {samples.data(), count}; }
};

class InertialUnit {
 public:
  /// Demands figures that validate. `dt`: sampling period, s.
  InertialUnit(const ImuNoise& figures, std::uint64_t seed, double dt);

  /// Writes the next sample's gyro and accelerometer values, given the true ones; leaves its
  /// attitude.
  void measure(const Eigen::Vector3d& omega_B, const Eigen::Vector3d& specific_force_B,
               ImuSample& sample);
  /// The attitude with rotation noise of `sigma` (rad) per axis.
  [[nodiscard]] Eigen::Quaterniond blurred(const Eigen::Quaterniond& q, double sigma);

  /// Biases of the last sample.
  [[nodiscard]] const Eigen::Vector3d& gyro_bias() const { return gyro_bias_; }
  [[nodiscard]] const Eigen::Vector3d& accel_bias() const { return accel_bias_; }

 private:
  [[nodiscard]] Eigen::Vector3d normal();

  ImuNoise figures_;
  double root_dt_;
  Random random_;
  Eigen::Vector3d gyro_bias_;
  Eigen::Vector3d accel_bias_;
};

}  // namespace dive::vehicle
