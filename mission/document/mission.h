#pragma once
// A mission as typed values, every value with its place in the file.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "behaviors/failsafes.h"
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

/// An AprilTag of family 36h11, fixed where the mission has it.
struct TagSpec {
  Located<int> id;
  double size_m = 0.0;       ///< Edge of the black square.
  Position position;         ///< Of its middle.
  double heading_deg = 0.0;  ///< Compass: whither the print looks,
  double pitch_deg = 0.0;    ///< and how far up: 0 upright, 90 face up.
  double roll_deg = 0.0;     ///< Clockwise, as one looks at it.
  double sigma_m = 0.02;     ///< What the survey errs by, along each axis
  double sigma_deg = 2.0;    ///< and about each.
};

struct Timeout {
  Located<double> seconds;
  Located<std::string> on_timeout;  ///< State entered then.
};

struct GotoState {
  Goal goal;
};
/// A transect is one as well: the ends of its legs are the goals.
struct GoalSequenceState {
  std::vector<Goal> goals;
};
struct HoldState {
  Located<double> duration_s;
};
struct RetraceState {};
struct SurfaceState {};

/// monostate: a `state` with nothing inside. It steers nothing and only watches; there is one only
/// in those regions of a parallel that do not steer.
using Leaf = std::variant<std::monostate, GotoState, GoalSequenceState, HoldState, RetraceState,
                          SurfaceState>;

/// What is done on entry, on exit or in a transition.
struct ActionSpec {
  enum class Kind {
    kLog,      ///< `text` goes into the log.
    kRaise,    ///< The event `text` is raised.
    kPayload,  ///< The payload is told `text`.
  } kind = Kind::kLog;
  Located<std::string> text;
  bool once = false;  ///< Never again in this dive, not even after a restart.
};

struct TransitionSpec {
  std::vector<std::string> events;
  std::vector<Span> event_spans;  ///< Of `events`, index by index.
  std::optional<Guard> guard;
  std::vector<Located<std::string>> targets;
  std::vector<ActionSpec> actions;
  bool internal = false;
  Span span;
};

enum class StateType { kCompound, kParallel, kFinal, kShallowHistory, kDeepHistory, kLeaf };

/// When a path that is being followed is planned anew.
struct ReplanPolicy {
  std::optional<Located<double>> period_s;
  std::optional<Located<double>> deviation_m;    ///< From the path.
  std::optional<Located<double>> clearance_m;    ///< Of the rest of the path, below it.
  std::optional<Located<double>> no_progress_s;  ///< Without getting nearer to the goal.
  bool map_change = true;                        ///< When the map changed on the path.
  bool estimator_switch = true;
  std::optional<Located<double>> max_replans;  ///< Per leg; see replans_per_leg().
};

struct StateSpec {
  Located<std::string> id;
  std::string element;  ///< As written: "goto", "transect", ...; of a part, that of the whole.
  StateType type = StateType::kLeaf;
  Leaf leaf;  ///< Only for kLeaf.
  std::optional<Located<std::string>>
      initial;            ///< Compound: the first child where not written. History: its default.
  bool overhead = false;  ///< Declared here or on an ancestor.
  std::optional<Timeout> timeout;
  std::optional<ReplanPolicy> replan;  ///< Where it differs from the mission's.
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
};

/// What a mission makes of water that was never seen.
enum class EyesName { kRangeCamera, kCameras };

enum class UnknownPolicy {
  kCautious,    ///< The vehicle swims no faster than it can stop within what it has seen.
  kOptimistic,  ///< It is taken for water until something is seen in it.
};

/// What a restarted executive does.
enum class ResumePolicy { kContinue, kHold, kSurface };

/// Index by behaviors::FailsafeKind.
struct Failsafes {
  behaviors::FailsafePolicies policies = behaviors::default_policies();
  std::array<double, behaviors::kFailsafeCount> threshold{};
  std::array<std::optional<Span>, behaviors::kFailsafeCount> written;  ///< Where, if at all.
  std::vector<std::array<Located<double>, 2>> fence;                   ///< x, y of its corners.

  [[nodiscard]] behaviors::FailsafePolicy& policy(behaviors::FailsafeKind kind) {
    return policies[static_cast<std::size_t>(kind)];
  }
  [[nodiscard]] const behaviors::FailsafePolicy& policy(behaviors::FailsafeKind kind) const {
    return policies[static_cast<std::size_t>(kind)];
  }
};

struct Mission {
  SourceText source;
  std::string id;
  std::string description;
  Located<double> speed;  ///< m/s
  planning::AttitudeMode attitude = planning::AttitudeMode::kFree;
  /// Set: nothing is known of the water when the dive begins, and `map_file` is what is there when
  /// the mission is rehearsed on deck. The vehicle is never told.
  std::optional<UnknownPolicy> unknown;
  Located<EyesName> eyes = {EyesName::kRangeCamera, {}};  ///< That unknown water is seen with.
  double memory_s = 600.0;        ///< How long what was seen of unknown water is remembered.
  Located<std::string> map_file;  ///< As written; empty: unknown water, and no rehearsal.
  std::string map_path;           ///< Resolved beneath the mission's folder; empty as `map_file`.
  std::string water = "coastal_sea";  ///< That is looked through in simulation.
  Located<EstimatorName> estimator;
  bool closes_loops = true;  ///< By sight.
  std::vector<TagSpec> tags;
  Position start;
  double start_heading_deg = 90.0;  ///< Compass.
  Limits limits;
  ReplanPolicy replan;
  Failsafes failsafes;
  ResumePolicy resume = ResumePolicy::kSurface;
  Located<double> max_gap_s;     ///< Away for longer than that it surfaces, whatever the policy.
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

/// Does the cameras' estimator say where the vehicle is, where it can?
[[nodiscard]] inline bool goes_by_sight(const Mission& mission) {
  return mission.estimator.value == EstimatorName::kVisualInertial;
}

/// Is unknown water seen with a range camera, and not with the cameras?
[[nodiscard]] inline bool has_range_camera(const Mission& mission) {
  return mission.unknown && mission.eyes.value == EyesName::kRangeCamera;
}

/// Is it the cameras that unknown water is seen with?
[[nodiscard]] inline bool has_stereo_eyes(const Mission& mission) {
  return mission.unknown && mission.eyes.value == EyesName::kCameras;
}

/// Can the mission be dived in simulation? Unknown water without a rehearsal cannot.
[[nodiscard]] inline bool has_rehearsal(const Mission& mission) {
  return !mission.unknown || !mission.map_file.value.empty();
}

/// As the policy says, else what suits the water: where all has to be found out on the way there is
/// more to be planned anew.
[[nodiscard]] int replans_per_leg(const Mission& mission, const ReplanPolicy& policy);

/// Compass heading (deg, clockwise from north) to yaw (rad, counter-clockwise from east).
[[nodiscard]] double heading_to_yaw(double heading_deg);

/// The attitude mode that the schema's word names: free, flat or horizontal.
[[nodiscard]] planning::AttitudeMode attitude_mode(std::string_view word);

}  // namespace dive::mission
