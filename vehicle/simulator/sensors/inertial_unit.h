#pragma once
// An IMU at B's origin at 200 Hz: white noise, turn-on biases that walk, errors of scale and of the
// axes' directions, and a gyro that acceleration affects.
//
//   gyro = (I + S_g) omega + G f + b_g + n_g,  accel = (I + S_a) f + b_a + n_a,  b' = walk
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

/// Errors per axis, and per element of a matrix. The densities are those of the data sheet of a
/// MicroStrain 3DM-GX4-25 (0.005 deg/s/sqrt(Hz), 100 ug/sqrt(Hz)), which gives no random walks:
/// with these the biases exceed its stated stability (10 deg/h, 0.04 mg) within a minute or two.
/// Turn-on biases, scale errors and g-sensitivity are those of uncalibrated MEMS units, such as an
/// ADIS16448: its gyro at rest reads 0.02 to 0.1 rad/s.
struct ImuNoise {
  double gyro_density = 8.7e-5;       ///< rad/s/sqrt(Hz).
  double gyro_walk = 5e-6;            ///< rad/s^2/sqrt(Hz).
  double accel_density = 9.8e-4;      ///< m/s^2/sqrt(Hz).
  double accel_walk = 4e-5;           ///< m/s^3/sqrt(Hz).
  double gyro_bias_sigma = 0.04;      ///< Turn-on bias, rad/s.
  double accel_bias_sigma = 0.12;     ///< Turn-on bias, m/s^2.
  double scale_sigma = 0.005;         ///< Elements of S_g and S_a.
  double g_sensitivity_sigma = 3e-5;  ///< Elements of G, rad/s per m/s^2: 0.015 deg/s/g.

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
  [[nodiscard]] Eigen::Matrix3d normal_matrix();

  ImuNoise figures_;
  double root_dt_;
  Random random_;
  Eigen::Vector3d gyro_bias_;
  Eigen::Vector3d accel_bias_;
  Eigen::Matrix3d gyro_scale_;   ///< I + S_g
  Eigen::Matrix3d accel_scale_;  ///< I + S_a
  Eigen::Matrix3d gyro_by_accel_;
};

}  // namespace dive::vehicle
