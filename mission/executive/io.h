#pragma once
// Inputs and outputs of one step of the executive. All of them are written to the log; a replay
// feeds the same inputs and compares the outputs.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/map_correction.h"
#include "common/map_fix.h"
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
  std::string state;  ///< Atomic state that sends the query.
  std::string cause;  ///< Cause of the query.
  planning::PlanRequest request;
};

struct PlanReply {
  std::int64_t id = 0;        ///< Id of the query that it answers.
  planning::PlanResult plan;  ///< The plan; waypoints only if it is accepted.
};

struct StepInputs {
  Utime now = 0;
  std::optional<ImuSample> imu;
  std::optional<DepthSample> depth;
  std::optional<HealthSample> health;
  std::optional<PlanReply> plan;
  std::optional<OperatorCommand> operator_command;
  /// Changes of the observed map in this tick, at most one from each source. None may be dropped:
  /// if a source has two, the second one waits for the next tick.
  std::vector<planning::ObstacleUpdate> obstacles;
  /// The observed map with these changes. Not logged: update_map() computes it from all changes so
  /// far.
  planning::ObservedMap observed_map;
  std::optional<planning::FreeAhead> free_ahead;
  std::optional<planning::ObstacleAhead> obstacle_ahead = {};
  std::optional<planning::PoseCorrection> pose_correction;
  /// In the tick in which a loop closure moves the observed map: the vehicle and its trail move
  /// with it, before `pose_correction`.
  std::optional<MapCorrection> map_correction = {};
  std::optional<MapFix> map_fix = {};
  /// What the cameras' estimator says of one pair of pictures. Each one counts as well.
  std::optional<estimation::VisionEstimate> vision = {};
  /// In a tick in which it has changed. In simulation nothing is lost.
  std::optional<RecordingLoss> loss = {};
};

/// One transition of the state machine.
struct TransitionRecord {
  std::string from;    ///< Innermost active state before.
  std::string to;      ///< Innermost active state after.
  std::string event;   ///< Event; empty for the first entry and eventless transitions.
  std::string cause;   ///< Cause, a sentence for the operator.
  std::string guards;  ///< Guards evaluated, with values: "depth > 3 m: false, ...".
};

/// A transition with its time since the dive began.
struct TimedTransition {
  double t_s = 0.0;
  TransitionRecord record;
};

/// A change of the failsafe ladder.
struct FailsafeRecord {
  std::string rung;
  std::string cause;      ///< Failsafe that set the rung.
  std::string competing;  ///< Other active failsafes, comma-separated.
  std::string why;        ///< Reason, a sentence for the operator.
};

/// An action or a note besides the commands.
struct ActionRecord {
  enum class Kind {
    kLog,      ///< Line written by the mission.
    kPayload,  ///< `text` is sent to the payload.
    kNote,     ///< What the executive ignored or decided without a transition.
  };
  static constexpr Kind kLastKind = Kind::kNote;
  Kind kind = Kind::kLog;
  std::string text;
  bool once = false;  ///< A payload command that is sent at most once per dive.
};

struct Status {
  std::string state;  ///< Innermost active state.
  std::string goal;   ///< Present goal; may be empty.
  double distance_to_go_m = 0.0;
  double time_to_go_s = 0.0;
  double depth_m = 0.0;
  double clearance_m = 0.0;  ///< Certified clearance of the path being followed, m; 0 without one.
  double cross_track_m = 0.0;  ///< Distance to the line p_{i-1} p_i, m.
  /// Margin of the position ahead (planning/certify/position_margin.h); infinite: nothing is near.
  double margin_sigma = std::numeric_limits<double>::infinity();
  int segment = 0;
  std::string rung;  ///< Rung of the failsafe ladder.
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
