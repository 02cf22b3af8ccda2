#include "mission/simulation/simulated_dive.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "mission/executive/behavior_factory.h"
#include "mission/record/unfinished_dive.h"
#include "mission/simulation/contacts.h"
#include "mission/simulation/simulated_cameras.h"
#include "mission/states/atomic_state.h"
#include "planning/world/scene.h"
#include "vehicle/simulator/drawn_world.h"
#include "vehicle/simulator/water/named_waters.h"

namespace dive::mission {
namespace {

static_assert(kControlPeriod == from_seconds(vehicle::Simulator::kTick));

constexpr double kKnownRate = 2.0;  // Hz, of scans beside a known map

vehicle::StereoCameraOptions cameras_of(const Mission& mission, const DiveSettings& settings) {
  return settings.cameras.value_or(*vehicle::stereo_camera_in(mission.simulated_water));
}

std::optional<estimation::VisionOptions> calibration_of(const Mission& mission,
                                                        const DiveSettings& settings) {
  if (!uses_visual_inertial(mission)) return std::nullopt;
  return vision_options(cameras_of(mission, settings),
                        *with_imu(settings.conditions).inertial_unit);
}

/// Conditions of the simulator, whose time starts at 0 in a resumed dive.
vehicle::Conditions conditions_of(const Mission& mission, const DiveSettings& settings) {
  vehicle::Conditions conditions =
      uses_visual_inertial(mission) ? with_imu(settings.conditions) : settings.conditions;
  if (!settings.resume) return conditions;
  const double elapsed_s =
      settings.resume->checkpoint.elapsed_s + settings.resume->gap_s.value_or(0.0);
  conditions.declared_current = conditions.declared_current.from(elapsed_s);
  return conditions;
}

/// Statistics of the estimates of a dive.
class EstimateWatch {
 public:
  explicit EstimateWatch(DiveResult& result) : result_(result) {}

  void observe(const estimation::StateEstimate& estimate) {
    if (!estimate.valid) return;
    if (last_.valid) {
      const double step_m = (estimate.X_WB.p - last_.X_WB.p).head<2>().norm();
      result_.largest_step_m = std::max(result_.largest_step_m, step_m);
      result_.estimator_switches += last_.source != estimate.source ? 1 : 0;
    }
    last_ = estimate;
    result_.estimator = estimation::to_string(estimate.source);
  }

 private:
  DiveResult& result_;
  estimation::StateEstimate last_;  ///< Invalid before the first estimate.
};

/// Measures how long the vehicle has stayed in one place, by ground truth.
class Rest {
 public:
  void observe(const vehicle::GroundTruth& truth) {
    now_ = truth.utime;
    place_W_ = truth.X_WB.p;
    if (!past_.empty() && now_ - past_.back().utime < kMicrosecondsPerSecond) return;
    past_.push_back({now_, place_W_});
  }
  /// Time since it was last away from its present position, with a resolution of one second.
  [[nodiscard]] double seconds() const {
    Utime since = now_;
    for (auto was = past_.rbegin(); was != past_.rend(); ++was) {
      if ((was->p_W - place_W_).norm() > kSamePlace) break;
      since = was->utime;
    }
    return to_seconds(now_ - since);
  }

 private:
  struct Past {
    Utime utime = 0;
    Eigen::Vector3d p_W;
  };
  std::vector<Past> past_;  ///< Positions, one per second.
  Utime now_ = 0;
  Eigen::Vector3d place_W_ = Eigen::Vector3d::Zero();
};

/// The built-in simulator as the vehicle of a dive, with its faults, its script and its ground
/// truth.
class SimulatedVehiclePort final : public VehiclePort {
 public:
  SimulatedVehiclePort(const Mission& mission, const planning::World& world,
                       const vehicle::Model& model, const DiveSettings& settings,
                       const DiveObserver& observer)
      : settings_(settings),
        observer_(observer),
        world_(simulated_world(world, settings)),
        simulator_(model,
                   settings.resume ? settings.resume->checkpoint.X_WB : start_pose(mission, world),
                   conditions_of(mission, settings), settings.seed),
        X_MW_(vehicle::drawn_map_motion(settings.conditions, settings.seed).inverse()),
        contacts_(settings.triangles ? *settings.triangles : vehicle::TriangulatedWorld(world_),
                  model.hull, settings.diver, X_MW_),
        injector_(settings.faults) {
    if (const auto range_camera = range_camera_of(mission, settings.range_camera)) {
      range_camera_.emplace(
          world_,
          vehicle::drawn_range_camera(
              *range_camera, settings.conditions.range_misalignment_sigma_deg, settings.seed),
          settings.seed);
    }
    if (!uses_visual_inertial(mission)) return;
    vehicle::StereoCameraOptions cameras = cameras_of(mission, settings);
    cameras.tags = settings.tags.value_or(known_tags(mission, world));
    cameras_.emplace(world_, cameras, settings.conditions, settings.seed);
  }

  [[nodiscard]] Utime begin() override { return 0; }

  [[nodiscard]] std::optional<Utime> wait_for_tick() override {
    if (is_held_) return std::nullopt;
    samples_ = simulator_.step(rates_);
    return truth().utime;
  }

  void sense(StepInputs& inputs) override {
    inputs.imu = samples_.imu;
    inputs.depth = samples_.depth;
    inputs.health = samples_.health;
  }

  void amend(StepInputs& inputs) override {
    std::vector<AppearingObstacle> appearing;
    if (settings_.script) settings_.script({inputs, injector_, simulator_, appearing});
    injector_.apply(truth(), inputs, appearing);
    if (!appearing.empty()) appear(appearing, inputs);
    touched_ = contacts_.observe(truth().utime, truth().X_WB);
    if (settings_.sensor_observer) settings_.sensor_observer(samples_, truth(), contacts_.diver());
  }

  void command(const StepOutputs& outputs) override { rates_ = outputs.rates; }

  [[nodiscard]] std::optional<RangeScan> take_scan() override {
    if (!range_camera_) return std::nullopt;
    range_camera_->set_frozen(injector_.is_on(FaultKind::kRangeFrozen));
    if (!range_camera_->due(truth().utime)) return std::nullopt;
    return range_camera_->take(truth().utime, truth().X_WB, contacts_.diver());
  }

  [[nodiscard]] std::vector<ImuSample> take_imu_samples() override {
    vehicle::InertialSamples samples = samples_.inertial;
    injector_.apply(samples);
    return {samples.list().begin(), samples.list().end()};
  }

  [[nodiscard]] StereoPair take_images() override {
    auto [left, right] = cameras_->render(truth(), contacts_.diver(), injector_);
    return {std::move(left), std::move(right)};
  }

  void end_tick(const StepInputs& inputs, const StepOutputs& outputs) override {
    const vehicle::GroundTruth in_map = truth_in_map();
    const std::vector<Collision> collisions =
        collisions_at(in_map.utime, in_map.X_WB, touched_, outputs.estimate);
    result_.collisions.insert(result_.collisions.end(), collisions.begin(), collisions.end());
    watch_.observe(outputs.estimate);
    if (observer_) observer_(inputs, outputs, in_map, {collisions, contacts_.nearest()});
    rest_.observe(truth());
    last_ = outputs;
    is_held_ =
        is_kept(outputs.status) && settings_.rest_s > 0.0 && rest_.seconds() >= settings_.rest_s;
  }

  [[nodiscard]] DiveResult finish(OnboardReport report);

 private:
  void appear(const std::vector<AppearingObstacle>& appearing, StepInputs& inputs) {
    planning::ObstacleUpdate update = as_update(appearing, contacts_.appeared(), inputs.now);
    if (!update.cells.empty()) inputs.obstacles.push_back(std::move(update));
    planning::World hidden;
    for (const AppearingObstacle& one : appearing) {
      if (one.is_observed) continue;
      hidden.obstacles.push_back({"hidden", planning::Box{one.size}, one.X_WO});
    }
    if (range_camera_ && !hidden.obstacles.empty()) range_camera_->add(hidden);
    contacts_.add(appearing);
  }
  [[nodiscard]] const vehicle::GroundTruth& truth() const { return simulator_.truth(); }
  [[nodiscard]] vehicle::GroundTruth truth_in_map() const {
    vehicle::GroundTruth in_map = truth();
    in_map.X_WB = X_MW_ * in_map.X_WB;
    return in_map;
  }
  void name_outcome(const ExecutiveResult& executive);

  const DiveSettings& settings_;
  const DiveObserver& observer_;
  const planning::World world_;  ///< The true one.
  vehicle::Simulator simulator_;
  const Pose X_MW_;  ///< From the simulated world to the map.
  Contacts contacts_;
  FaultInjector injector_;
  std::optional<vehicle::RangeCamera> range_camera_;
  std::optional<SimulatedCameras> cameras_;
  vehicle::PseudoRates rates_;
  vehicle::SensorSamples samples_;    ///< Samples of this tick.
  std::vector<std::string> touched_;  ///< Obstacles with which a contact began in this tick.
  DiveResult result_;
  EstimateWatch watch_{result_};
  Rest rest_;
  StepOutputs last_;
  bool is_held_ = false;
};

DiveResult SimulatedVehiclePort::finish(OnboardReport report) {
  result_.rung = last_.status.rung;
  result_.duration_s = to_seconds(truth().utime);
  result_.rest_s = rest_.seconds();
  result_.distance_m = truth().distance_swum_m;
  result_.nearest = contacts_.nearest();
  result_.diver_clearance_m = contacts_.diver_clearance_m();
  result_.energy_wh = truth().energy_used_wh;
  result_.final_depth_m = -truth().X_WB.p.z();
  if (last_.estimate.valid) {
    result_.final_error_m = horizontal_error(last_.estimate, truth_in_map().X_WB);
    result_.final_sigma_m = estimation::horizontal_sigma(last_.estimate);
  }
  result_.plans = report.plans;
  result_.replans = report.replans;
  result_.transitions = std::move(report.transitions);
  result_.failsafes = std::move(report.failsafes);
  result_.observed_map = report.observed_map;
  result_.observed_points = std::move(report.observed_points);
  is_held_ = is_held_ || (is_kept(last_.status) && result_.rest_s >= kMinRest);
  name_outcome(report.executive);
  return std::move(result_);
}

void SimulatedVehiclePort::name_outcome(const ExecutiveResult& executive) {
  result_.outcome = to_string(executive.outcome);
  result_.final_state = executive.final_state;
  result_.cause = executive.cause;
  if (executive.outcome == Outcome::kRunning) {
    const UnfinishedDive dive{executive.final_state, result_.duration_s, result_.rest_s, is_held_,
                              result_.failsafes.empty() ? "" : result_.failsafes.back().why};
    result_.outcome = dive.outcome();
    result_.cause = dive.cause();
  }
  if (!result_.collisions.empty()) {
    result_.outcome = "failure";
    result_.cause = describe(result_.collisions);
  }
}

}  // namespace

std::optional<vehicle::RangeCameraOptions> range_camera_of(const Mission& mission,
                                                           vehicle::RangeCameraOptions options) {
  if (!uses_range_camera(mission)) return std::nullopt;
  if (!mission.unknown) options.rate_hz = std::min(options.rate_hz, kKnownRate);
  return options;
}

planning::World simulated_world(const planning::World& map, const DiveSettings& settings) {
  planning::World world =
      vehicle::drawn_world(settings.world.value_or(map), settings.conditions, settings.seed);
  world.obstacles.insert(world.obstacles.end(), settings.unmapped.begin(), settings.unmapped.end());
  return world;
}

Pose start_pose(const Mission& mission, const planning::World& world) {
  const planning::Scene scene(world);
  return Pose{mission.start.in_world(ground_height(scene, mission.start)),
              from_rpy(0.0, 0.0, heading_to_yaw(mission.start_heading_deg))};
}

std::string DiveSettings::validate() const {
  if (cameras) {
    if (std::string problem = cameras->validate(); !problem.empty()) return problem;
  }
  if (std::string problem = conditions.validate(); !problem.empty()) return problem;
  if (std::string problem = range_camera.validate(); !problem.empty()) return problem;
  if (diver) {
    if (std::string problem = diver->validate(); !problem.empty()) return problem;
  }
  return OnboardSettings::validate();
}

DiveResult simulate_dive(const Mission& mission, const planning::World& world,
                         const vehicle::Model& model, const DiveSettings& settings,
                         const DiveObserver& observer, const DiveKeeper& keeper) {
  OnboardDive dive(mission, world, model, settings, calibration_of(mission, settings),
                   OnLate::kBlock);
  SimulatedVehiclePort port(mission, world, model, settings, observer);
  return port.finish(dive.run(port, keeper));
}

}  // namespace dive::mission
