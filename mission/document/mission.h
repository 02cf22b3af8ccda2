#pragma once
// A mission as typed values, every value with its place in the file.

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "common/diagnostic.h"
#include "common/source_text.h"
#include "mission/document/guard.h"
#include "planning/trajopt/trajopt.h"

namespace dive::mission {

/// A value and where it was written; a default's span is that of the element it would stand in.
template <class T>
struct Located {
  T value{};
  Span span;
};

enum class ZUnits { kDepth, kAltitude, kZ };

/// A position as written: x east, y north (m, W), z by its datum.
struct Position {
  Located<double> x;
  Located<double> y;
  Located<double> z;
  ZUnits z_units = ZUnits::kDepth;

  /// In W. Altitude needs `floor_z` (m), the height of the ground there.
  [[nodiscard]] Eigen::Vector3d in_world(double floor_z) const;
};

struct Goal {
  Located<std::string> id;
  Position position;
  std::optional<Located<double>> heading_deg;  ///< Clockwise from north, as on a compass.
  Located<double> capture_radius;              ///< m
  Located<double> dwell_s;
  Span span;
};

struct Timeout {
  Located<double> seconds;
  Located<std::string> on_timeout;  ///< State entered then.
};

struct GotoState {
  Goal goal;
  Timeout timeout;
};
struct GoalSequenceState {
  std::vector<Goal> goals;
  Timeout timeout;
};
struct HoldState {
  Located<double> duration_s;
};
struct SurfaceState {
  std::optional<Timeout> timeout;
};

/// monostate: a `state` with nothing inside. It steers nothing and only watches; there is one only
/// in those regions of a parallel that do not steer.
using Leaf = std::variant<std::monostate, GotoState, GoalSequenceState, HoldState, SurfaceState>;

struct TransitionSpec {
  std::vector<std::string> events;
  std::vector<Span> event_spans;  ///< Of `events`, index by index.
  std::optional<Guard> guard;
  std::vector<Located<std::string>> targets;
  bool internal = false;
  Span span;
};

enum class StateType { kCompound, kParallel, kFinal, kShallowHistory, kDeepHistory, kLeaf };

struct StateSpec {
  Located<std::string> id;
  StateType type = StateType::kLeaf;
  Leaf leaf;  ///< Only for kLeaf.
  std::optional<Located<std::string>>
      initial;            ///< Compound: the first child where not written. History: its default.
  bool overhead = false;  ///< Declared here or on an ancestor.
  std::vector<TransitionSpec> transitions;
  std::vector<StateSpec> children;
};

struct Limits {
  Located<double> max_depth;        ///< m
  Located<double> min_altitude;     ///< m
  Located<double> clearance;        ///< D_min, m
  Located<double> mission_timeout;  ///< s
  Located<double> battery_reserve;  ///< fraction
};

struct ReplanPolicy {
  std::optional<Located<double>> period_s;
  std::optional<Located<double>> deviation_m;  ///< From the path.
  Located<double> max_replans;                 ///< Per leg.
};

/// The rungs of the ladder that a failsafe of this version may name.
enum class Rung { kNone, kWarn, kAbortAndSurface, kEmergencySurface };
[[nodiscard]] const char* to_string(Rung rung);

struct FailsafeSpec {
  Located<Rung> rung;
  Located<double> persistence_s;  ///< The condition must hold that long.
};

struct Failsafes {
  FailsafeSpec leak;
  FailsafeSpec overtime;         ///< Beyond limits.mission_timeout.
  FailsafeSpec overdepth;        ///< Below limits.max_depth.
  FailsafeSpec planner_failure;  ///< `planner_failures` in a row.
  Located<double> planner_failures;
};

struct Mission {
  SourceText source;
  std::string id;
  std::string description;
  Located<double> speed;  ///< m/s
  planning::AttitudeMode attitude = planning::AttitudeMode::kFree;
  Located<std::string> map_file;  ///< As written.
  std::string map_path;           ///< Resolved beneath the mission's folder.
  Position start;
  double start_heading_deg = 90.0;  ///< Compass.
  Limits limits;
  ReplanPolicy replan;
  Failsafes failsafes;
  Located<std::string> initial;  ///< First state.
  std::vector<StateSpec> states;
};

/// Reads, validates against missions/mission.xsd (compiled in), types and checks a mission. All
/// mistakes are reported, not only the first. Nothing is returned when there was an error.
/// Codes: FILE-*, XML-*, XSD-*, MIS-*.
[[nodiscard]] std::optional<Mission> load_mission(const std::string& path,
                                                  Diagnostics& diagnostics);

/// Whether the map's file is looked for: a log brings its map with it.
enum class MapFile { kMustExist, kNotNeeded };

/// The same from memory; `source.path()` says where the map is looked for.
[[nodiscard]] std::optional<Mission> parse_mission(SourceText source, Diagnostics& diagnostics,
                                                   MapFile map_file = MapFile::kMustExist);

/// Compass heading (deg, clockwise from north) to yaw (rad, counter-clockwise from east).
[[nodiscard]] double heading_to_yaw(double heading_deg);

/// The attitude mode that the schema's word names: free, flat or horizontal.
[[nodiscard]] planning::AttitudeMode attitude_mode(std::string_view word);

}  // namespace dive::mission
