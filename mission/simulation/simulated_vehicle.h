#pragma once
// The simulated Aqua2 as a separate process: sends samples over LCM, receives commands.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "mission/record/collision.h"
#include "mission/simulation/faults.h"
#include "planning/world/world.h"
#include "vehicle/link/bus.h"
#include "vehicle/model.h"
#include "vehicle/simulator/cameras/stereo_camera.h"
#include "vehicle/simulator/sensors/range_camera.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// A jump of the sensors' clock: from `at_s` on, their times are later by the given amount.
struct ClockJump {
  double at_s = 0.0;
  double by_s = 0.0;
};

/// A restart of the vehicle's driver: at `at_s` it forgets every command and the exit path, sends
/// and executes nothing for `away_s`, and then its sensors' clock starts at 0 again.
struct DriverRestart {
  double at_s = 0.0;
  double away_s = 0.0;
};

struct VehicleSettings {
  std::uint64_t seed = 1;
  vehicle::Conditions conditions;
  std::vector<Fault> faults;
  std::optional<ClockJump> clock_jump;
  std::optional<DriverRestart> driver_restart = {};         ///< Not in lock-step.
  std::optional<vehicle::RangeCameraOptions> range_camera;  ///< Requires options that validate.
  /// Sends images and IMU samples; requires options that validate.
  std::optional<vehicle::StereoCameraOptions> cameras = {};
  /// Waits in every tick for the executive's command and repeats the samples until it arrives: as
  /// fast as the machines allow, and bit-identical to a dive in the built-in simulator.
  bool lockstep = false;
  double max_seconds = 3600.0;  ///< Dive time.
};

struct VehicleReport {
  /// finished, surfaced (no process sends commands any more), time, interrupted
  std::string ended;
  double duration_s = 0.0;
  double distance_m = 0.0;
  NearestApproach nearest;
  std::vector<Collision> collisions;  ///< Without estimates, which only the executive has.
  double final_depth_m = 0.0;
  double energy_wh = 0.0;
  double silent_s = 0.0;      ///< Time without any command, after the first.
  double supervised_s = 0.0;  ///< Time under the supervisor's commands.
  std::int64_t refused = 0;   ///< Commands that were refused.
};

/// Called once per tick: true if the vehicle shall continue.
using VehicleWanted = std::function<bool()>;

/// Lies still at the start until the first command, then runs until the executive that it obeys
/// reports its end (and, in real time, sends no command any more), or until the vehicle has been at
/// the surface for a while without commands. `clock` is real time, or faster by a factor.
[[nodiscard]] VehicleReport simulate_vehicle(const planning::World& world,
                                             const vehicle::Model& model, const Pose& start_X_WB,
                                             const VehicleSettings& settings, link::Bus& bus,
                                             Clock& clock, const VehicleWanted& wanted);

}  // namespace dive::mission
