#pragma once
// A scenario as typed values: one dive of a mission, a script, and the expected results.

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "common/diagnostic.h"
#include "common/source_text.h"
#include "mission/document/mission.h"
#include "mission/document/rules.h"
#include "mission/executive/io.h"
#include "mission/simulation/appearing_obstacle.h"
#include "mission/simulation/faults.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// The trigger of a script step: `after_s` after its first occurrence.
struct Trigger {
  enum class Kind { kTime, kState, kEvent, kGoal } kind = Kind::kTime;
  Located<std::string> name;  ///< Name of the state, event or goal.
  double after_s = 0.0;       ///< For kTime: time since the dive began.
};

// The action of a step.
struct FailAction {
  FaultKind kind = FaultKind::kLeak;
  double for_s = std::numeric_limits<double>::infinity();
};
enum class SampleStream { kImu, kDepth, kHealth, kPlan, kAll };
inline constexpr std::array<std::string_view, 5> kSampleStreamNames = {"imu", "depth", "health",
                                                                       "plan", "all"};
[[nodiscard]] std::optional<SampleStream> find_sample_stream(std::string_view name);
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
  AppearingObstacle obstacle;
  std::optional<double> ahead_m;  ///< Instead of a place: ahead of the vehicle, level, at its yaw.
};
using ScriptAction = std::variant<FailAction, LossAction, OperatorAction, HeartbeatAction,
                                  CurrentAction, ObstacleAction>;

struct ScriptStep {
  Trigger trigger;
  Located<std::string> id;  ///< Empty: no id.
  std::vector<ScriptAction> actions;
  Span span;
};

/// A condition that must hold, or must not.
struct Expectation {
  enum class Kind {
    kStepHappens,  ///< Implicitly expected of every step of the script.
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
  Located<std::string> name;  ///< Name of what is expected; for kBounds the quantity.
  std::string cause;          ///< Cause of a rung; empty: any.
  bool negated = false;
  Located<std::string> after;  ///< The id of a step; empty: the beginning of the dive.
  std::optional<Located<double>> within_s;
  std::optional<int> times;
  std::optional<Located<double>> at_least;
  std::optional<Located<double>> at_most;
  int step = -1;  ///< Step of kStepHappens.
  Eigen::Vector3d place_W = Eigen::Vector3d::Zero();
  double radius_m = 0.0;
  Span span;
};

struct Scenario {
  SourceText source;
  std::string id;
  std::string description;
  Located<std::string> mission_file;  ///< Path as written.
  std::string mission_path;           ///< Resolved from the folder of the scenario.
  std::uint64_t seed = 1;
  double rest_s = 0.0;  ///< 0: never safely held.
  /// Conditions that differ from those of the mission, with their values.
  std::vector<std::pair<std::string, double>> conditions;
  double camera_scale = 1.0;  ///< Scale of the pixels along each side.
  double camera_hz = 20.0;    ///< Image pairs per second, if the mission uses the cameras.
  std::optional<vehicle::DiverTrack> diver;  ///< Belongs to the script.
  std::vector<ScriptStep> steps;
  std::vector<Expectation> expectations;  ///< Includes the implicit ones, at the end.
};

/// Reads, validates against missions/scenario.xsd (compiled in) and converts a scenario. Reports
/// all mistakes and returns nothing if there was one. Codes: FILE-*, XML-*, XSD-*, SCN-*.
[[nodiscard]] std::optional<Scenario> load_scenario(const std::string& path,
                                                    Diagnostics& diagnostics);
/// Loads a scenario from memory; `source.path()` determines the folder of the mission.
[[nodiscard]] std::optional<Scenario> parse_scenario(SourceText source, Diagnostics& diagnostics);

/// Reports every name that the mission does not have, and fills in the positions of its goals.
/// Returns false if there was a mistake.
[[nodiscard]] bool suit_to_mission(Scenario& scenario, const Mission& mission,
                                   const planning::World& world, Diagnostics& diagnostics);

/// All SCN-* codes.
[[nodiscard]] std::span<const Rule> scenario_rules();

}  // namespace dive::mission
