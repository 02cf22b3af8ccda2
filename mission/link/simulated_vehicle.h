#pragma once
// The simulated Aqua2 as a process of its own: samples out over LCM, commands in.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "mission/check/faults.h"
#include "planning/world/world.h"
#include "vehicle/link/bus.h"
#include "vehicle/model.h"
#include "vehicle/simulator/range_camera.h"
#include "vehicle/simulator/simulator.h"
#include "vehicle/simulator/stereo_camera.h"

namespace dive::mission {

/// The clock of the sensors is set: from `at_s` on its times are so much later.
struct ClockJump {
  double at_s = 0.0;
  double by_s = 0.0;
};

struct VehicleSettings {
  std::uint64_t seed = 1;
  vehicle::Conditions conditions;
  std::vector<Fault> faults;
  std::optional<ClockJump> clock_jump;
  std::optional<vehicle::RangeCameraOptions> range_camera;  ///< Demands options that validate.
  /// Sends pictures and what the inertial unit says; demands options that validate.
  std::optional<vehicle::StereoCameraOptions> cameras = {};
  /// Waits for the executive's command for every tick, and says the samples again until it comes:
  /// as fast as the machines go, and the same dive as the built-in simulator's, bit for bit.
  bool lockstep = false;
  double max_seconds = 3600.0;  ///< Of dive time.
};

struct VehicleReport {
  std::string ended;  ///< finished, surfaced (nobody commands any more), time, interrupted
  double duration_s = 0.0;
  double distance_m = 0.0;
  double min_clearance_m = 0.0;
  int collisions = 0;
  double final_depth_m = 0.0;
  double energy_wh = 0.0;
  double silent_s = 0.0;      ///< Without any command, after the first.
  double supervised_s = 0.0;  ///< Under the supervisor's.
  std::int64_t refused = 0;   ///< Commands that were none.
};

/// Asked once a tick: shall the vehicle go on?
using VehicleWanted = std::function<bool()>;

/// Lies still at the start until the first command, dives until the executive says that it has
/// finished, or until it has been at the surface for a while with nobody in command. `clock` is
/// real time, or faster by a factor.
[[nodiscard]] VehicleReport simulate_vehicle(const planning::World& world,
                                             const vehicle::Model& model, const Pose& start_X_WB,
                                             const VehicleSettings& settings, link::Bus& bus,
                                             Clock& clock, const VehicleWanted& wanted);

}  // namespace dive::mission
