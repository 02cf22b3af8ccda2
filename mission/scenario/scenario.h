#pragma once
// A scenario as typed values: one dive of a mission, what happens to it, and what must come of it.

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "common/diagnostic.h"
#include "common/source_text.h"
#include "mission/check/faults.h"
#include "mission/document/mission.h"
#include "mission/document/rules.h"
#include "mission/executive/io.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// When a step of the script happens: `after_s` after the first time.
struct Trigger {
  enum class Kind { kTime, kState, kEvent, kGoal } kind = Kind::kTime;
  Located<std::string> name;  ///< Of the state, event or goal.
  double after_s = 0.0;       ///< Of kTime: after the dive began.
};

// What happens then.
struct FailAction {
  FaultKind kind = FaultKind::kLeak;
  double for_s = std::numeric_limits<double>::infinity();
};
enum class SampleStream { kImu, kDepth, kHealth, kPlan, kAll };
struct LossAction {
  SampleStream of = SampleStream::kAll;
  double share = 0.0;
  double for_s = std::numeric_limits<double>::infinity();
};
struct OperatorAction {
  OperatorCommand command = OperatorCommand::kAbort;
};
struct HeartbeatAction {
  double every_s = 1.0;
  double for_s = std::numeric_limits<double>::infinity();
};
struct CurrentAction {
  Eigen::Vector3d current_W = Eigen::Vector3d::Zero();
};
struct ObstacleAction {
  SeenObstacle obstacle;
};
using ScriptAction = std::variant<FailAction, LossAction, OperatorAction, HeartbeatAction,
                                  CurrentAction, ObstacleAction>;

struct ScriptStep {
  Trigger trigger;
  Located<std::string> id;  ///< Empty: has none.
  std::vector<ScriptAction> actions;
  Span span;
};

/// One thing that must be so, or must not.
struct Expectation {
  enum class Kind {
    kStepHappens,  ///< Expected of every step of the script without being said.
    kOutcome,
    kFinalState,
    kEnters,
    kEvent,
    kRung,
    kReplan,
    kPayload,
    kLine,
    kHeadsFor,
    kReaches,
    kEndsNear,
    kBounds,
  } kind = Kind::kOutcome;
  Located<std::string> name;  ///< What is expected; of kBounds the quantity.
  std::string cause;          ///< Of a rung; empty: any.
  bool negated = false;
  Located<std::string> after;  ///< The id of a step; empty: the beginning of the dive.
  std::optional<Located<double>> within_s;
  std::optional<int> times;
  std::optional<Located<double>> at_least;
  std::optional<Located<double>> at_most;
  int step = -1;  ///< Of kStepHappens.
  Eigen::Vector3d place_W = Eigen::Vector3d::Zero();
  double radius_m = 0.0;
  Span span;
};

struct Scenario {
  SourceText source;
  std::string id;
  std::string description;
  Located<std::string> mission_file;  ///< As written.
  std::string mission_path;           ///< Found from the folder of the scenario.
  std::uint64_t seed = 1;
  double rest_s = 0.0;  ///< 0: never held.
  vehicle::Conditions conditions;
  double camera_scale = 1.0;  ///< Of the pixels along each side ...
  double camera_hz = 20.0;    ///< ... and pairs a second, where the mission uses the cameras.
  std::vector<ScriptStep> steps;
  std::vector<Expectation> expectations;  ///< With those that go without saying, at the end.
};

/// Reads, validates against missions/scenario.xsd (compiled in) and types a scenario. All mistakes
/// are reported; nothing is returned when there was one. Codes: FILE-*, XML-*, XSD-*, SCN-*.
[[nodiscard]] std::optional<Scenario> load_scenario(const std::string& path,
                                                    Diagnostics& diagnostics);
/// The same from memory; `source.path()` says where the mission is looked for.
[[nodiscard]] std::optional<Scenario> parse_scenario(SourceText source, Diagnostics& diagnostics);

/// Reports every name that the mission does not have, and fills in where its goals are. False when
/// there was a mistake.
[[nodiscard]] bool suit_to_mission(Scenario& scenario, const Mission& mission,
                                   const planning::World& world, Diagnostics& diagnostics);

/// All SCN-* codes.
[[nodiscard]] std::span<const Rule> scenario_rules();

}  // namespace dive::mission
