#pragma once
// The supervisor's decisions, without link and clock:
//
//   watching   -> holding     no command of the executive for command_timeout_s
//   holding    -> watching    the executive, or a restarted one, sends commands again
//   holding    -> following   it did not come back while the exit path allows to hold
//   following, holding -> ascending   open water is above, or nothing else is left
//
// Once it follows or ascends, it keeps the vehicle to the surface: the executive's position would
// be wrong. vehicle::ExitGuidance has the rules of holding, following and ascending.
//
// Map fixes are used while it holds or follows, if they are of the executive's map.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/clock.h"
#include "common/map_fix.h"
#include "common/measurements.h"
#include "common/motion_model.h"
#include "common/range_noise.h"
#include "estimation/map_fix_filter.h"
#include "estimation/state_estimate.h"
#include "planning/map_matching/map_surface.h"
#include "vehicle/command_timing.h"
#include "vehicle/exit_guidance.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/command_gate.h"
#include "vehicle/own_autopilot.h"

namespace dive::mission {

/// The known map in which scans of the range camera tell the position.
struct SupervisedMap {
  std::shared_ptr<const planning::MapSurface> surface = {};
  std::uint64_t digest = 0;  ///< planning::world_digest() of it.
  RangeNoise noise = {};     ///< Of the range camera.
  estimation::MapFixOptions fixes = {};
};

struct SupervisorSettings {
  /// Maximum silence after the executive's first command.
  double command_timeout_s = to_seconds(vehicle::kCommandTimeout);
  MotionModel motion = {};
  std::optional<SupervisedMap> map = {};  ///< Empty: dead reckoning alone.
};

struct SupervisorReport {
  bool took_over = false;         ///< It brought the vehicle home: it followed or ascended.
  double silent_s = 0.0;          ///< Silence at the last time it began to hold, s.
  int holds = 0;                  ///< Number of times it held the vehicle.
  int given_back = 0;             ///< Number of times it gave the vehicle back.
  bool followed = false;          ///< It followed an exit path.
  int fixes = 0;                  ///< Number of map fixes that it used.
  bool blindly = false;           ///< It ascended without knowing open water above.
  bool surfaced = false;          ///< At the surface by the depth sensor.
  bool presumed = false;          ///< At the surface by time only, without a depth sensor.
  int restarts = 0;               ///< Number of executives after the first.
  bool second_executive = false;  ///< Two executives sent commands at once.
  std::int64_t refused = 0;       ///< Commands that were refused.
};

/// Called with a sentence at the start and end of each phase.
using SupervisorLog = std::function<void(const std::string&)>;

/// All times are on the supervisor's clock.
class Supervision {
 public:
  /// `session_id`: of this start of the supervisor.
  Supervision(const SupervisorSettings& settings, std::uint64_t session_id,
              const SupervisorLog& log);

  void receive(const link::VehicleCommand& command, Utime now);
  void receive(const link::Heartbeat& heartbeat, Utime now);
  void receive(const link::ExitPathMessage& message);
  void receive(const ImuSample& sample, Utime now);
  void receive(const DepthSample& sample, Utime now);
  void receive(const MapFix& fix);

  /// True while fixes are used: scans are worth matching.
  [[nodiscard]] bool wants_fixes() const;
  /// The vehicle's pose, by which a scan is placed.
  [[nodiscard]] const estimation::StateEstimate& estimate() const { return guidance_.estimate(); }
  /// The supervisor's time of a sample stamped `utime` by the vehicle.
  [[nodiscard]] Utime own_time(Utime utime) const {
    return utime + vehicle_time_at_ - vehicle_time_;
  }

  /// The supervisor's own command, to be sent at once; empty while it watches.
  [[nodiscard]] std::optional<link::VehicleCommand> step(Utime now);

  /// True when the executive has finished, or the vehicle is at the surface.
  [[nodiscard]] bool is_over(Utime now) const;
  [[nodiscard]] SupervisorReport report() const;

 private:
  void observe(const std::optional<ImuSample>& imu, const std::optional<DepthSample>& depth,
               Utime now);
  [[nodiscard]] vehicle::PseudoRates efforts(Utime now);
  void watch(Utime now);
  [[nodiscard]] bool has_recovered(Utime now) const;
  void give_back();
  void note_phase(vehicle::ExitPhase before, Utime now);
  [[nodiscard]] link::VehicleCommand command(Utime now);

  SupervisorSettings settings_;
  std::uint64_t session_id_;
  const SupervisorLog& log_;
  link::CommandGate executive_;
  vehicle::ExitGuidance guidance_;
  vehicle::OwnAutopilot autopilot_;          ///< Predicts the autopilot of the vehicle.
  vehicle::PseudoRates efforts_;             ///< What the vehicle executes.
  std::optional<link::VehicleCommand> own_;  ///< Last command of its own, while it commands.
  std::optional<Utime> finished_at_;  ///< Arrival of the executive's report that it has finished.
  std::optional<Utime> continuous_since_;  ///< Begin of its present series of commands.
  Utime commanded_at_ = 0;
  std::optional<std::uint64_t> held_session_;  ///< Session that fell silent.
  Utime vehicle_time_ = 0;                     ///< Newest time of a sensor ...
  Utime vehicle_time_at_ = 0;                  ///< ... and its arrival.
  std::int64_t sequence_ = 0;
  std::optional<std::uint64_t> map_digest_;  ///< Of the executive.
  SupervisorReport report_;
};

}  // namespace dive::mission
