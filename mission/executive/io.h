#pragma once
// What goes into and comes out of one step of the executive. Everything that passes here is
// written to the log, and a replay feeds the same inputs and compares the outputs.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/measurements.h"
#include "common/operator_command.h"
#include "estimation/state_estimate.h"
#include "estimation/vision_estimate.h"
#include "mission/executive/recording_loss.h"
#include "planning/mapping/scan_result.h"
#include "planning/plan.h"
#include "planning/world/observed_map.h"
#include "planning/world/obstacle_update.h"
#include "vehicle/command.h"

namespace dive::mission {

struct PlanQuery {
  std::int64_t id = 0;
  std::string state;  ///< The leaf that asks ...
  std::string cause;  ///< ... and why.
  planning::PlanRequest request;
};

struct PlanReply {
  std::int64_t id = 0;        ///< Of the query it answers.
  planning::PlanResult plan;  ///< With waypoints only where it is accepted.
};

struct StepInputs {
  Utime now = 0;
  std::optional<ImuSample> imu;
  std::optional<DepthSample> depth;
  std::optional<HealthSample> health;
  std::optional<PlanReply> plan;
  std::optional<OperatorCommand> operator_command;
  /// Changes of the observed map in this tick, at most one of each source. Each one counts: where
  /// two have come from a source, one waits for its tick.
  std::vector<planning::ObstacleUpdate> obstacles;
  /// The observed map with these changes. Not logged: update_map() makes it from all changes so
  /// far.
  planning::ObservedMap observed_map;
  std::optional<planning::FreeAhead> free_ahead;
  std::optional<planning::PoseCorrection> pose_correction;
  /// What the cameras' estimator says of one pair of pictures. Each one counts as well.
  std::optional<estimation::VisionEstimate> vision = {};
  /// In a tick in which it has changed. In simulation nothing is lost.
  std::optional<RecordingLoss> loss = {};
};

/// One transition of the state machine.
struct TransitionRecord {
  std::string from;    ///< Innermost active state before.
  std::string to;      ///< Innermost active state after.
  std::string event;   ///< Empty for the first entry and eventless transitions.
  std::string cause;   ///< For people: why.
  std::string guards;  ///< Evaluated on the way, with their values: "depth > 3 m: false, ...".
};

/// And when: since the dive began.
struct TimedTransition {
  double t_s = 0.0;
  TransitionRecord record;
};

/// A change of the failsafe ladder.
struct FailsafeRecord {
  std::string rung;
  std::string cause;      ///< The failsafe that chose it.
  std::string competing;  ///< Others that are active, comma-separated.
  std::string why;        ///< For people.
};

/// Something done or noted beside steering.
struct ActionRecord {
  enum class Kind {
    kLog,      ///< The mission's own line.
    kPayload,  ///< The payload is told `text`.
    kNote,     ///< What the executive ignored or decided without a transition.
  } kind = Kind::kLog;
  std::string text;
  bool once = false;  ///< A payload command that is sent at most once per dive.
};

struct Status {
  std::string state;  ///< Innermost active state.
  std::string goal;   ///< Goal heading for, may be empty.
  double distance_to_go_m = 0.0;
  double time_to_go_s = 0.0;
  double depth_m = 0.0;
  double clearance_m = 0.0;    ///< Certified, of the path being followed; 0 without one.
  double cross_track_m = 0.0;  ///< Distance to the line p_{i-1} p_i.
  int segment = 0;
  std::string rung;  ///< Of the failsafe ladder.
  bool finished = false;
};

struct StepOutputs {
  vehicle::Command command;
  vehicle::PseudoRates rates;
  estimation::StateEstimate estimate;
  Status status;
  std::optional<PlanQuery> plan_query;
  std::vector<TransitionRecord> transitions;
  std::vector<FailsafeRecord> failsafes;
  std::vector<ActionRecord> actions;
};

}  // namespace dive::mission
