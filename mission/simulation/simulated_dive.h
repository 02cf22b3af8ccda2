#pragma once
// One dive of a mission in the built-in simulator, as fast as the machine allows.

#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/tag.h"
#include "mission/document/mission.h"
#include "mission/executive/io.h"
#include "mission/onboard/onboard_dive.h"
#include "mission/onboard/settings.h"
#include "mission/record/collision.h"
#include "mission/simulation/appearing_obstacle.h"
#include "mission/simulation/faults.h"
#include "planning/world/observed_map.h"
#include "planning/world/world.h"
#include "vehicle/model.h"
#include "vehicle/simulator/cameras/stereo_camera.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/ground_truth/ground_truth.h"
#include "vehicle/simulator/sensors/range_camera.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// The objects that a script may change every tick before the step.
struct DiveHands {
  StepInputs& inputs;
  FaultInjector& faults;
  vehicle::Simulator& simulator;
  std::vector<AppearingObstacle>& appearing;  ///< In this tick.
};

/// Its changes to the inputs are logged with them: a dive with a script is replayed without it.
using DiveScript = std::function<void(const DiveHands&)>;

/// Called every tick with the simulator's samples before they are processed, and with the ground
/// truth in the simulated world; X_WD: pose of the diver there.
using SensorObserver = std::function<void(const vehicle::SensorSamples&,
                                          const vehicle::GroundTruth&, const std::optional<Pose>&)>;

struct DiveSettings : OnboardSettings {
  vehicle::Conditions conditions;
  std::vector<Fault> faults;
  DiveScript script;  ///< May be empty.
  /// File of the vehicle's description, for the command that repeats the dive; empty: compiled in.
  std::string vehicle_path = {};
  double rest_s = 0.0;  ///< Time safely held after which the dive ends as "held"; 0: it continues.
  std::optional<planning::World> world = {};  ///< The world; absent: it is what the map says.
  std::vector<planning::Obstacle> unmapped;   ///< Objects in the world that the map lacks.
  /// simulated_world() as triangles, shared among dives; absent: made for this dive.
  std::optional<vehicle::TriangulatedWorld> triangles = {};
  // Used in an unknown environment.
  vehicle::RangeCameraOptions range_camera;
  std::optional<vehicle::DiverTrack> diver;  ///< Track of a diver in the water.
  // Used with the visual-inertial estimator.
  /// Absent: cameras for the water type.
  std::optional<vehicle::StereoCameraOptions> cameras = {};
  /// Actual tags; absent: the mission's tags at their given poses.
  std::optional<std::vector<Tag>> tags = {};
  SensorObserver sensor_observer = nullptr;

  [[nodiscard]] std::string validate() const;
};

struct DiveResult {
  std::string outcome;  ///< success, aborted, held, failure
  std::string final_state;
  std::string rung;   ///< Rung of the failsafe ladder at the end.
  std::string cause;  ///< Empty on success.
  double duration_s = 0.0;
  double rest_s = 0.0;      ///< Time up to the end within 0.5 m of the end position, ground truth.
  double distance_m = 0.0;  ///< Distance swum, ground truth.
  NearestApproach nearest;  ///< Ground truth.
  /// Smallest distance to the diver, ground truth; infinite without one.
  double diver_clearance_m = std::numeric_limits<double>::infinity();
  std::vector<Collision> collisions;  ///< Ground truth, in order of time.
  int plans = 0;
  int replans = 0;  ///< Plans requested while a path was being followed.
  double energy_wh = 0.0;
  double final_depth_m = 0.0;  ///< Ground truth.
  /// Horizontal position error at the end, and estimation::horizontal_sigma() of it, m; NaN without
  /// a valid estimate.
  double final_error_m = std::numeric_limits<double>::quiet_NaN();
  double final_sigma_m = std::numeric_limits<double>::quiet_NaN();
  std::string estimator;  ///< Active estimator at the end.
  int estimator_switches = 0;
  double largest_step_m = 0.0;  ///< Largest horizontal change of the estimate in one tick.
  std::vector<TimedTransition> transitions;
  std::vector<FailsafeRecord> failsafes;
  planning::ObservedMap observed_map;                 ///< At the end.
  std::vector<Eigen::Vector3f> observed_points = {};  ///< Points of that map, in W.
};

/// The range camera of a simulated dive; none if the mission does not use it. Beside a known
/// map two scans a second are enough.
[[nodiscard]] std::optional<vehicle::RangeCameraOptions> range_camera_of(
    const Mission& mission, vehicle::RangeCameraOptions options = {});

/// The true world of a simulated dive: `settings.world`, or else the map, with drawn errors, and
/// the unmapped objects.
[[nodiscard]] planning::World simulated_world(const planning::World& map,
                                              const DiveSettings& settings);

/// The start pose of the mission.
[[nodiscard]] Pose start_pose(const Mission& mission, const planning::World& world);

/// The contacts of one tick, by ground truth.
struct TickContacts {
  std::span<const Collision> begun;  ///< Collisions that begin in it.
  const NearestApproach& nearest;    ///< Since the dive began.
};

/// Called every tick, after the step. The true pose is relative to the map, in which goals, paths
/// and estimates are, wherever the drawn errors have moved the map in the simulated world.
using DiveObserver = std::function<void(const StepInputs&, const StepOutputs&,
                                        const vehicle::GroundTruth&, const TickContacts&)>;

/// In an unknown environment `world` is the simulated world: only the range camera and the ground
/// truth use it. Runs until the machine has ended, or for the longest allowed time: then "held" if
/// a failsafe kept the vehicle in one place for at least the last 30 s, otherwise a failure. A
/// collision is a failure whatever the executive reports.
[[nodiscard]] DiveResult simulate_dive(const Mission& mission, const planning::World& world,
                                       const vehicle::Model& model, const DiveSettings& settings,
                                       const DiveObserver& observer,
                                       const DiveKeeper& keeper = nullptr);

}  // namespace dive::mission
