#pragma once
// The simulated Aqua2: six degrees of freedom with added mass, drag, buoyancy, six flippers,
// current, sensor noise, bias and latency. (Equations of motion: Fossen 2011, "Handbook of Marine
// Craft Hydrodynamics and Motion Control", ch. 6-8; figures of the real vehicle:
// vehicle/aqua2_figures.h.)

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/measurements.h"
#include "common/se3.h"
#include "planning/world/world.h"
#include "vehicle/command.h"
#include "vehicle/model.h"
#include "vehicle/simulator/inertial_unit.h"

namespace dive::vehicle {

/// The water and the imperfections of one dive: pool conditions by default. "sigma" values are
/// drawn once per seed; "noise" values at every sample.
struct Conditions {
  Eigen::Vector3d current_W = Eigen::Vector3d::Zero();  ///< m/s.
  double speed_scale_sigma = 0.01;                      ///< Relative error of the gait's speed.
  double heading_bias_sigma_deg = 0.5;
  double attitude_noise_deg = 0.1;
  double gyro_noise = 0.01;   ///< rad/s.
  double accel_noise = 0.01;  ///< m/s^2.
  double depth_noise_m = 0.01;
  double sensor_latency_s = 0.02;
  double battery_capacity_wh = 200.0;
  double battery_voltage = 28.8;
  double battery_fraction = 1.0;  ///< At the start.
  /// An inertial unit for a visual-inertial estimator, beside the 50 Hz of the other; it changes
  /// nothing else. Not among the names.
  std::optional<ImuNoise> inertial_unit = std::nullopt;

  /// Sets one by its name, e.g. "current_x" = 0.1; false when there is no such name.
  [[nodiscard]] bool set(const std::string& name, double value);
  /// All names with their values, in a fixed order.
  [[nodiscard]] std::vector<std::pair<std::string, double>> list() const;
  [[nodiscard]] std::string validate() const;
};

struct SensorSamples {
  std::optional<ImuSample> imu;        ///< 50 Hz.
  std::optional<DepthSample> depth;    ///< 50 Hz.
  std::optional<HealthSample> health;  ///< 1 Hz.
  InertialSamples inertial = {};       ///< 200 Hz; none without an inertial unit.
};

struct GroundTruth {
  Utime utime = 0;
  Pose X_WB;
  Eigen::Vector3d v_WB_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d omega_WB_B = Eigen::Vector3d::Zero();
  double distance_swum_m = 0.0;
  double energy_used_wh = 0.0;
  Eigen::Vector3d gyro_bias_B = Eigen::Vector3d::Zero();   ///< Of the inertial unit, rad/s ...
  Eigen::Vector3d accel_bias_B = Eigen::Vector3d::Zero();  ///< ... and m/s^2.
};

class Simulator {
 public:
  static constexpr double kTick = 0.02;  ///< s, one control tick.

  Simulator(const Model& model, const Pose& start_X_WB, Conditions conditions, std::uint64_t seed);
  Simulator(Simulator&&) noexcept;
  ~Simulator();

  /// Advances one control tick under `rates` and returns what the sensors say at its end.
  [[nodiscard]] SensorSamples step(const PseudoRates& rates);
  [[nodiscard]] const GroundTruth& truth() const;
  /// From now on the health samples report water in the hull.
  void inject_leak();
  /// From now on the water moves at `current_W` (m/s). The vehicle keeps its velocity over ground.
  void set_current(const Eigen::Vector3d& current_W);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::vehicle
