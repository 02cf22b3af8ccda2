#pragma once
// A mission as typed values, each with its position in the file.

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "behaviors/failsafes.h"
#include "common/declared_current.h"
#include "common/diagnostic.h"
#include "common/geodesy.h"
#include "common/source_text.h"
#include "mission/document/guard.h"
#include "planning/attitude_mode.h"

namespace dive::mission {

/// A value and its position in the file; a default has the span of the element that lacks it.
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

  /// Position in W. An altitude needs `floor_z` (m), the height of the ground below.
  [[nodiscard]] Eigen::Vector3d in_world(double floor_z) const;
};

struct Goal {
  Located<std::string> id;
  Position position;
  std::optional<Located<double>> heading_deg;  ///< Clockwise from north, as on a compass.
  Located<double> capture_radius;              ///< m
  Located<double> dwell_s;
  std::optional<double> dwell_heading_deg;  ///< Heading that the vehicle turns to for the dwell.
  /// Reduced clearance of the leg to this goal, instead of the one in the limits.
  std::optional<Located<double>> reduced_clearance;
  Span span;
};

/// An AprilTag of family 36h11 at the fixed pose that the mission gives.
struct TagSpec {
  Located<int> id;
  double size_m = 0.0;       ///< Edge of the black square, m.
  Position position;         ///< Position of its centre.
  double heading_deg = 0.0;  ///< Compass heading of the outward normal.
  double pitch_deg = 0.0;    ///< Elevation of the outward normal: 0 upright, 90 face up.
  double roll_deg = 0.0;     ///< Rotation, clockwise for a viewer of the tag.
  double sigma_m = 0.02;     ///< Standard deviation of the surveyed position, along each axis.
  double sigma_deg = 2.0;    ///< Standard deviation of the surveyed attitude, about each axis.
};

struct Timeout {
  Located<double> seconds;
  Located<std::string> on_timeout;  ///< State entered at the timeout.
};

/// The behaviour of an atomic state as the mission describes it: mission/states/atomic_state.h.
class AtomicState;

/// An action on entry, on exit or in a transition.
struct ActionSpec {
  enum class Kind {
    kLog,      ///< Writes `text` to the log.
    kRaise,    ///< Raises the event `text`.
    kPayload,  ///< Sends `text` to the payload.
  } kind = Kind::kLog;
  Located<std::string> text;
  bool once = false;  ///< Executed at most once in this dive, restarts included.
};

struct TransitionSpec {
  std::vector<std::string> events;
  std::vector<Span> event_spans;  ///< Spans of `events`, index by index.
  std::optional<Guard> guard;
  std::vector<Located<std::string>> targets;
  std::vector<ActionSpec> actions;
  bool internal = false;
  Span span;
};

enum class StateType { kCompound, kParallel, kFinal, kShallowHistory, kDeepHistory, kAtomic };

/// Conditions that cause a replan of the path being followed.
struct ReplanPolicy {
  std::optional<Located<double>> period_s;
  std::optional<Located<double>> deviation_m;    ///< Distance from the path.
  std::optional<Located<double>> clearance_m;    ///< Minimum clearance of the rest of the path.
  std::optional<Located<double>> no_progress_s;  ///< Time without progress towards the goal.
  bool map_change = true;                        ///< Replan when the map changes on the path.
  bool estimator_switch = true;
  std::optional<Located<double>> max_replans;  ///< Maximum per leg; see replans_per_leg().
};

struct StateSpec {
  Located<std::string> id;
  std::string element;  ///< Element as written: "goto", "transect", ...; a part has its parent's.
  StateType type = StateType::kAtomic;
  /// Behaviour, used only by kAtomic. Null: an empty `state`, which only monitors and commands
  /// nothing. It is allowed only in regions of a parallel that do not steer.
  std::shared_ptr<const AtomicState> atomic;
  bool is_generated = false;  ///< Made of its parent's element, not written by itself.
  std::optional<Located<std::string>>
      initial;            ///< Compound: the first child if not written. History: its default.
  bool overhead = false;  ///< Declared here or on an ancestor.
  std::optional<Timeout> timeout;
  std::optional<ReplanPolicy> replan;  ///< Policy of this state, if it has its own.
  std::vector<ActionSpec> on_entry;
  std::vector<ActionSpec> on_exit;
  std::vector<TransitionSpec> transitions;
  std::vector<StateSpec> children;
};

struct Limits {
  Located<double> max_depth;        ///< m
  Located<double> min_altitude;     ///< m
  Located<double> clearance;        ///< D_min, m
  Located<double> mission_timeout;  ///< s
  Located<double> battery_reserve;  ///< fraction
  /// Minimum clearance (m) of a leg while it leaves a start that lacks the clearance. Absent: every
  /// leg keeps the clearance.
  std::optional<Located<double>> reduced_clearance;
  /// Height by which a path may leave the heights between the start and the goal of its leg, m.
  std::optional<Located<double>> max_depth_change;
};

/// The sensor whose scans the mapper turns into obstacles.
enum class MappingSensor { kNone, kRangeCamera, kStereo };

/// How a mission treats space that was never observed.
enum class UnknownPolicy {
  kCautious,    ///< Speed is limited so that the vehicle stops within observed free space.
  kOptimistic,  ///< Unobserved space counts as free.
};

/// Behaviour of an executive after a restart.
enum class ResumePolicy { kContinue, kHold, kSurface };

/// The place on the earth of x = y = 0.
struct Origin {
  GeoPoint place;
  std::optional<double> declination_deg;  ///< Magnetic north, clockwise from true north.
  Span span;
};

/// Whose abort is accepted on a link with a key.
enum class AbortAuthority { kAnyone, kKey };

/// Indexed by behaviors::FailsafeKind. A failsafe that is not listed keeps its default policy.
struct Failsafes {
  behaviors::FailsafePolicies policies = behaviors::default_policies();
  std::array<double, behaviors::kFailsafeCount> threshold{};
  /// Position in the file, if listed.
  std::array<std::optional<Span>, behaviors::kFailsafeCount> written;
  std::vector<std::array<Located<double>, 2>> fence;  ///< x, y of the corners.

  [[nodiscard]] behaviors::FailsafePolicy& policy(behaviors::FailsafeKind kind) {
    return policies[static_cast<std::size_t>(kind)];
  }
  [[nodiscard]] const behaviors::FailsafePolicy& policy(behaviors::FailsafeKind kind) const {
    return policies[static_cast<std::size_t>(kind)];
  }
};

/// What is known before the dive, as standard deviations: the estimator expects errors of this
/// size, and the simulator draws them.
struct Priors {
  double start_m = 0.1;   ///< Position at the release, per horizontal axis, m.
  double map_m = 0.05;    ///< Position of a known map, per horizontal axis, m.
  double map_deg = 0.5;   ///< Orientation of a known map about the vertical, deg.
  double current = 0.02;  ///< Difference from the declared current, per horizontal axis, m/s.
};

struct Mission {
  SourceText source;
  std::string id;
  std::string description;
  std::optional<Origin> origin;  ///< If the mission states it.
  Located<double> speed;         ///< m/s
  planning::AttitudeMode attitude = planning::AttitudeMode::kFree;
  /// Set: the environment is unknown when the dive begins, and `map_file` is the simulated world.
  /// The vehicle never receives it.
  std::optional<UnknownPolicy> unknown;
  std::optional<Located<MappingSensor>> mapping_sensor;  ///< As written; see mapping_sensor().
  bool allows_fixes = true;     ///< In a known map: map fixes from scans of the range camera.
  bool trusts_absence = false;  ///< Mapped objects that scans see through leave the map.
  Span trusts_absence_span;     ///< Position of `trust_absence`, if it is given.
  /// Span of information="prefer", if that is given: paths where scans tell the position.
  std::optional<Span> prefers_information;
  double memory_s = 600.0;  ///< Time for which obstacles observed during the dive are kept.
  /// Path as written; empty: unknown environment without a simulated world.
  Located<std::string> map_file;
  std::string map_path;  ///< Resolved beneath the mission's folder; empty if `map_file` is.
  /// In a known map: the world of simulated dives if it is not the map, as written and resolved.
  std::optional<Located<std::string>> simulation_map;
  std::string simulation_map_path;
  std::string simulated_water;  ///< Optical water type in simulation.
  Located<EstimatorName> estimator;
  bool closes_loops = true;  ///< Loop closure of the visual-inertial estimator.
  std::vector<TagSpec> tags;
  Position start;
  double start_heading_deg = 90.0;  ///< Compass heading.
  Priors priors;
  Located<DeclaredCurrent> current;  ///< Still water if the mission declares none.
  Limits limits;
  ReplanPolicy replan;
  Failsafes failsafes;
  AbortAuthority abort_authority = AbortAuthority::kAnyone;
  ResumePolicy resume = ResumePolicy::kSurface;
  Located<double> max_gap_s;     ///< After a longer gap the vehicle surfaces, whatever the policy.
  Located<std::string> initial;  ///< Initial state.
  std::vector<StateSpec> states;
};

/// Reads a mission, validates it against missions/mission.xsd (compiled in), converts and checks
/// it. Reports all mistakes, not only the first. Returns nothing if there was an error. Codes:
/// FILE-*, XML-*, XSD-*, MIS-*.
[[nodiscard]] std::optional<Mission> load_mission(const std::string& path,
                                                  Diagnostics& diagnostics);

/// Whether the map file must exist: a log contains its map.
enum class MapFile { kMustExist, kNotNeeded };

/// Loads a mission from memory; `source.path()` determines the folder of the map.
[[nodiscard]] std::optional<Mission> parse_mission(SourceText source, Diagnostics& diagnostics,
                                                   MapFile map_file = MapFile::kMustExist);

/// True if the visual-inertial estimator provides the position where it can.
[[nodiscard]] inline bool uses_visual_inertial(const Mission& mission) {
  return mission.estimator.value == EstimatorName::kVisualInertial;
}

/// True if scans correct the position in a known map. Tags give the position in the map too, and
/// their surveyed places may not agree with it.
[[nodiscard]] inline bool uses_map_fixes(const Mission& mission) {
  return !mission.unknown && mission.allows_fixes && mission.tags.empty();
}

/// Sensor that maps an unknown environment, or what a known map lacks.
[[nodiscard]] inline MappingSensor mapping_sensor(const Mission& mission) {
  if (mission.mapping_sensor) return mission.mapping_sensor->value;
  const bool has_range_camera = mission.unknown || uses_map_fixes(mission);
  return has_range_camera ? MappingSensor::kRangeCamera : MappingSensor::kNone;
}

/// True if the stereo cameras map; what a range camera would show is then not used.
[[nodiscard]] inline bool maps_with_stereo(const Mission& mission) {
  return mapping_sensor(mission) == MappingSensor::kStereo;
}

/// True if the mission uses the scans of a range camera.
[[nodiscard]] inline bool uses_range_camera(const Mission& mission) {
  return mapping_sensor(mission) == MappingSensor::kRangeCamera ||
         (uses_map_fixes(mission) && !maps_with_stereo(mission));
}

/// True if the mission can be simulated: an unknown environment needs a simulated world.
[[nodiscard]] inline bool has_simulation_map(const Mission& mission) {
  return !mission.unknown || !mission.map_file.value.empty();
}

/// The policy's value, or else a default for the environment: an unknown one needs more replans.
[[nodiscard]] int replans_per_leg(const Mission& mission, const ReplanPolicy& policy);

/// A heading or bearing in [0, 360); that of a yaw (rad) is 90 - rad_to_deg(yaw).
[[nodiscard]] double compass_heading_deg(double degrees);
/// Compass heading (deg, clockwise from north) to yaw (rad, counter-clockwise from east).
[[nodiscard]] double heading_to_yaw(double heading_deg);

/// The attitude mode for the schema's value: free, flat or horizontal.
[[nodiscard]] planning::AttitudeMode attitude_mode(std::string_view word);

}  // namespace dive::mission
