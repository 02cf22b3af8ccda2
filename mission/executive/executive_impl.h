#pragma once
// The members of the executive, shared by executive.cpp (the tick), executive_sense.cpp,
// executive_decide.cpp and executive_command.cpp (its stages), and executive_restart.cpp (the state
// kept for a restart). Private to mission/executive.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "behaviors/failsafes.h"
#include "behaviors/monitors.h"
#include "mission/executive/active_behavior.h"
#include "mission/executive/control_stage.h"
#include "mission/executive/executive.h"
#include "mission/executive/exit_path_keeper.h"
#include "mission/executive/localization.h"
#include "mission/executive/machine.h"
#include "mission/executive/machine_runner.h"
#include "mission/executive/map_view.h"
#include "mission/executive/margin_monitor.h"
#include "mission/executive/missing_objects.h"
#include "mission/executive/overhead_monitor.h"
#include "mission/executive/sensing.h"
#include "mission/executive/situation.h"
#include "mission/executive/surfacing_fallback.h"
#include "vehicle/command_timing.h"

namespace dive::mission {

struct Executive::Impl final : private MachineRunner::Observer {
  /// us of a stop for an obstacle ahead: until the next scan of a slow sensor, and the next but
  /// one.
  static constexpr Utime kProximityStop = 1'200'000;
  /// Beside an overhead, time for which a lost attitude is awaited before the ascent without it: a
  /// driver that restarts is silent for seconds.
  static constexpr Utime kAwaitAttitude = 8'000'000;

  Impl(const Mission& mission_in, const planning::World& world, const vehicle::Model& model,
       ExecutiveOptions options_in);

  void step(const StepInputs& inputs);
  [[nodiscard]] Checkpoint checkpoint() const;
  [[nodiscard]] ExecutiveResult result() const;

  // The stages of a tick, in order.
  void begin_tick(Utime now);
  void sense(const StepInputs& inputs);
  void estimate(const StepInputs& inputs);
  void start();
  void assess();
  void collect_events(const StepInputs& inputs);
  void evaluate_failsafes();
  void process_events();
  void steer();
  void actuate();
  void fill_status();
  void keep_exit_path();

  // Parts of stages.
  void estimate_over_gap();
  void assess_margin();
  [[nodiscard]] Eigen::Vector3d first_position() const;
  [[nodiscard]] double first_sigma() const;
  /// Declared current at `now`, m/s; a restarted executive continues the mission's time.
  [[nodiscard]] Eigen::Vector2d declared_current(Utime now) const;
  void on_entered_atomic(statechart::StateId state) override {
    behavior.enter(state, goals_left_out);
  }
  void on_exited(statechart::StateId state) override { behavior.leave(state); }
  void take_scan(const StepInputs& inputs);
  void take_object_changes(const StepInputs& inputs);
  void take_loss(Utime now, const RecordingLoss& loss);
  void resume(const Resume& from);
  void resume_by_policy(double gap_s);
  void obey(OperatorCommand command);
  void abort(std::string cause);
  void skip();
  void take_rung(const behaviors::FailsafeLadder::Change& change);
  void follow_behavior();
  void move_map(const MapCorrection& correction);
  void take_obstacle(const planning::ObstacleAhead& obstacle);
  void stop_for_obstacle();
  void hold_speed();
  void fail(statechart::StateId state, behaviors::Failure failure);
  [[nodiscard]] vehicle::Command keep_station() const;
  [[nodiscard]] bool measures_its_speed() const;
  /// True if the vehicle has received no command for longer than one lasts.
  [[nodiscard]] bool has_gap() const { return situation.now - last_step > vehicle::kCommandStale; }
  [[nodiscard]] bool is_held() const {
    return paused || ladder.rung() == behaviors::Rung::kHold || situation.now < given_back_at;
  }
  void raise_event(std::string name, std::string cause) {
    events.push_back({std::move(name), std::move(cause)});
  }
  void note(std::string text) {
    ActionRecord& record = outputs.actions.emplace_back();
    record.kind = ActionRecord::Kind::kNote;
    record.text = std::move(text);
  }

  const Mission& mission;
  ExecutiveOptions options;
  StepOutputs outputs;  // Outputs of the last step, or of the current one so far.
  MapView map;
  MissingObjects missing_objects;
  Machine machine;
  MachineRunner runner;
  OverheadMonitor overhead_monitor;
  MarginMonitor margin_monitor;
  ActiveBehavior behavior;
  Localization localization;
  ControlStage control;
  ExitPathKeeper exit_path;
  SurfacingFallback fallback;
  behaviors::Monitors monitors;
  Sensing sensing;
  behaviors::FailsafeLadder ladder;

  Situation situation;
  std::vector<Pose> way;                    ///< What the behaviour means to do, for assess().
  std::vector<Event> events;                ///< Events of this tick, in processing order.
  std::vector<std::string> object_changes;  ///< Objects of the map that are gone or back, in words.
  bool skip_requested = false;
  bool trail_is_trusted = false;  ///< Progress::trusts_trail of the previous tick.
  bool path_was_blocked = false;  ///< True if an observed obstacle blocked it in the previous tick.
  bool started = false;
  bool paused = false;
  Utime held_for = 0;  ///< Total time for which the behaviours' clock was stopped, us.
  Utime started_at = 0;
  Utime last_step = 0;
  Utime given_back_at = 0;  ///< Commands may have no effect before: the supervisor holds.
  std::optional<vehicle::Command> held;     ///< Command that keeps station during a hold.
  Utime attitude_known_at = 0;              ///< Last tick with a fresh attitude.
  Utime stop_until = 0;                     ///< End of the stop for an obstacle ahead.
  std::optional<vehicle::Command> stopped;  ///< Command that keeps station during that stop.
  vehicle::Command command;
  bool brakes = false;     ///< True if the command's speed is kept by thrust in either direction.
  int goals_left_out = 0;  ///< Goals reached before a restart.
  std::optional<estimation::ImuBias> imu_bias;  ///< For checkpoint().
};

}  // namespace dive::mission
