#pragma once
// One dive of a mission in the built-in simulator, as fast as the machine goes.

#include <functional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/tag.h"
#include "mission/check/faults.h"
#include "mission/document/mission.h"
#include "mission/executive/executive.h"
#include "mission/executive/io.h"
#include "planning/mapping/mapper.h"
#include "planning/planner.h"
#include "planning/world/seen.h"
#include "planning/world/world.h"
#include "vehicle/model.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/range_camera.h"
#include "vehicle/simulator/simulator.h"
#include "vehicle/simulator/stereo_camera.h"

namespace dive::mission {

/// What a script may lay hands on, every tick before the step.
struct DiveHands {
  StepInputs& inputs;
  FaultInjector& faults;
  vehicle::Simulator& simulator;
};

/// What it does to the inputs is logged with them: a dive with a script is replayed without it.
using DiveScript = std::function<void(const DiveHands&)>;

/// Told every tick what the simulator has returned, before anything is made of it; X_WD: of the
/// diver in the water.
using SensorObserver = std::function<void(const vehicle::SensorSamples&,
                                          const vehicle::GroundTruth&, const std::optional<Pose>&)>;

struct DiveSettings {
  std::uint64_t seed = 1;
  vehicle::Conditions conditions;
  int planner_latency_ticks = 5;  ///< 100 ms: what a plan is allowed on the vehicle.
  std::vector<Fault> faults;
  DiveScript script;             ///< May be empty.
  std::optional<Resume> resume;  ///< Goes on from there, the vehicle at rest where it was thought.
  double rest_s =
      0.0;  ///< Ends, "held", when a failsafe has kept it in one place so long; 0: never.
  planning::PlannerOptions planner;
  // In unknown water:
  vehicle::RangeCameraOptions range_camera;
  planning::MapperOptions mapper;
  int mapper_latency_ticks = 2;              ///< 40 ms: what a sweep is allowed on the vehicle.
  std::optional<vehicle::DiverTrack> diver;  ///< Someone else in the water.
  // Where the mission asks for the visual-inertial estimator:
  std::optional<vehicle::StereoCameraOptions> cameras = {};  ///< Absent: as the water has them.
  /// That are really there; absent: those of the mission, where it has them.
  std::optional<std::vector<Tag>> tags = {};
  int vision_latency_ticks = 4;  ///< 80 ms: what a pair of pictures is allowed on the vehicle.
  int loop_latency_ticks = 20;   ///< 400 ms: what a keyframe is allowed.
  SensorObserver sensor_observer = nullptr;

  [[nodiscard]] std::string validate() const;
};

struct DiveResult {
  std::string outcome;  ///< success, aborted, held, failure
  std::string final_state;
  std::string rung;   ///< Of the failsafe ladder, at the end.
  std::string cause;  ///< Empty on success.
  double duration_s = 0.0;
  double distance_m = 0.0;       ///< Swum, ground truth.
  double min_clearance_m = 0.0;  ///< Ground truth.
  int collisions = 0;            ///< Ground truth.
  int plans = 0;
  int replans = 0;  ///< Of them, while a path was being followed.
  double energy_wh = 0.0;
  double final_depth_m = 0.0;     ///< Ground truth.
  double estimate_error_m = 0.0;  ///< |p - p_true| at the end ...
  double estimate_sigma_m = 0.0;  ///< ... and what the estimator believed of it, one sigma.
  std::string estimator;          ///< That was believed at the end.
  int estimator_switches = 0;
  double largest_step_m = 0.0;  ///< Of the estimate from one tick to the next, horizontally.
  std::vector<TimedTransition> transitions;
  std::vector<FailsafeRecord> failsafes;
  planning::SeenMap seen;                         ///< In unknown water: the map at the end ...
  std::vector<Eigen::Vector3f> seen_points = {};  ///< ... and its points, in W.
};

/// Where the mission has the vehicle begin.
[[nodiscard]] Pose start_pose(const Mission& mission, const planning::World& world);

/// Its tags, where it has them.
[[nodiscard]] std::vector<Tag> known_tags(const Mission& mission, const planning::World& world);

/// Told every tick, after the step and before its outputs reach the vehicle.
using DiveKeeper = std::function<void(const Executive&, const StepOutputs&)>;

/// Told every tick, after the step.
using DiveObserver =
    std::function<void(const StepInputs&, const StepOutputs&, const vehicle::GroundTruth&)>;

/// Half as long again as the mission may last, and the time of an abort that starts at its end.
[[nodiscard]] double longest_dive_s(const Mission& mission);

/// In unknown water `world` is what is really there: only the range camera and the ground truth
/// know it. Dives until the machine has ended, or for as long as the longest dive may last, which
/// is a failure. A collision is a failure whatever the executive thinks of it.
[[nodiscard]] DiveResult simulate_dive(const Mission& mission, const planning::World& world,
                                       const vehicle::Model& model, const DiveSettings& settings,
                                       const DiveObserver& observer,
                                       const DiveKeeper& keeper = nullptr);

}  // namespace dive::mission
