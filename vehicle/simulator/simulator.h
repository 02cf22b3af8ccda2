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
#include "common/declared_current.h"
#include "common/measurements.h"
#include "common/se3.h"
#include "planning/world/world.h"
#include "vehicle/command.h"
#include "vehicle/model.h"
#include "vehicle/simulator/sensors/inertial_unit.h"

namespace dive::vehicle {

/// Water and imperfections of one dive; the defaults are those of a real vehicle in calm water.
/// "sigma" values are drawn once per seed; "noise" values at every sample.
struct Conditions {
  /// The current that was declared before the dive, in the simulator's time. Not settable by name.
  DeclaredCurrent declared_current = {};
  Eigen::Vector3d current_W = Eigen::Vector3d::Zero();  ///< On top of the declared current, m/s.
  double speed_scale_sigma = 0.03;                      ///< Relative error of the gait's speed.
  double heading_bias_sigma_deg = 1.5;
  double heading_variation_deg = 1.0;  ///< Of the compass between places, near steel.
  double tilt_bias_sigma_deg = 0.3;    ///< Roll and pitch of the attitude sensor.
  double gyro_bias_sigma = 0.005;      ///< Of the attitude sensor, per axis, rad/s.
  double depth_bias_sigma_m = 0.03;    ///< Tide, air pressure and density.
  double hull_scatter = 0.1;           ///< Relative, of each drag, added mass and thrust.
  double buoyancy_sigma_n = 0.1;       ///< Of the trim with weights, N.
  /// Dives with the same one are dives of one vehicle: hull, trim and the gait's speed are drawn
  /// with it; 0: with the seed of the dive.
  double hull_seed = 0.0;
  double object_shift_sigma_m = 0.02;         ///< Of each object against the map, per axis.
  double range_misalignment_sigma_deg = 0.3;  ///< Of the range camera in its mount, per axis.
  // What a mission declares: mission::simulated_conditions(). Horizontally, per axis.
  double current_sigma = 0.0;       ///< On top of both, slowly varying, m/s.
  double start_sigma_m = 0.0;       ///< Of the release.
  double map_shift_sigma_m = 0.0;   ///< Of the whole world against the map.
  double map_turn_sigma_deg = 0.0;  ///< The same, about the vertical.
  double attitude_noise_deg = 0.1;
  double gyro_noise = 0.01;   ///< rad/s.
  double accel_noise = 0.01;  ///< m/s^2.
  double depth_noise_m = 0.01;
  double sensor_latency_s = 0.02;
  double battery_capacity_wh = 200.0;
  double battery_voltage = 28.8;
  double battery_fraction = 1.0;  ///< Battery fraction at the start.
  /// A 200 Hz IMU for a visual-inertial estimator, beside the 50 Hz AHRS; it changes nothing else.
  /// Not settable by name.
  std::optional<ImuNoise> inertial_unit = std::nullopt;

  /// Velocity of the water when the dive begins, without what is drawn, m/s.
  [[nodiscard]] Eigen::Vector3d first_current_W() const;
  /// Sets one by its name, e.g. "current_x" = 0.1; false if there is no such name.
  [[nodiscard]] bool set(const std::string& name, double value);
  /// All names with their values, in a fixed order.
  [[nodiscard]] std::vector<std::pair<std::string, double>> list() const;
  [[nodiscard]] std::string validate() const;
};

struct SensorSamples {
  std::optional<ImuSample> imu;        ///< 50 Hz.
  std::optional<DepthSample> depth;    ///< 50 Hz.
  std::optional<HealthSample> health;  ///< 1 Hz.
  InertialSamples inertial = {};       ///< 200 Hz; none without an IMU.
};

struct GroundTruth {
  Utime utime = 0;
  Pose X_WB;
  Eigen::Vector3d v_WB_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d omega_WB_B = Eigen::Vector3d::Zero();
  double distance_swum_m = 0.0;
  double energy_used_wh = 0.0;
  Eigen::Vector3d gyro_bias_B = Eigen::Vector3d::Zero();   ///< Gyro bias of the IMU, rad/s.
  Eigen::Vector3d accel_bias_B = Eigen::Vector3d::Zero();  ///< Accelerometer bias of the IMU,
                                                           ///< m/s^2.
};

class Simulator {
 public:
  static constexpr double kTick = 0.02;  ///< Control tick, s.

  /// Released at rest in the water: over ground the vehicle begins with the current's velocity, as
  /// one that a diver or a boat lets go.
  Simulator(const Model& model, const Pose& start_X_WB, Conditions conditions, std::uint64_t seed);
  Simulator(Simulator&&) noexcept;
  ~Simulator();

  /// Advances one control tick under `rates` and returns the samples at its end.
  [[nodiscard]] SensorSamples step(const PseudoRates& rates);
  [[nodiscard]] const GroundTruth& truth() const;
  /// Sets the water's velocity on top of what is declared and drawn to `current_W` (m/s) from now
  /// on. The vehicle keeps its velocity over ground.
  void set_current(const Eigen::Vector3d& current_W);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::vehicle
