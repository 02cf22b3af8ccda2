#include "mission/check/simulated_dive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/check/simulated_sight.h"
#include "mission/executive/changed_map.h"
#include "mission/executive/leaf_behaviors.h"
#include "mission/executive/mapper_service.h"
#include "mission/executive/planner_service.h"
#include "mission/executive/stereo_eyes.h"
#include "planning/world/scene.h"
#include "vehicle/simulator/ground_truth.h"

namespace dive::mission {
namespace {

/// How near to anything, by ground truth.
struct Touched {
  double min_clearance_m = std::numeric_limits<double>::infinity();
  int collisions = 0;
};

constexpr double kSamePlace = 0.5;  // m

constexpr double kGraceSeconds = 120.0;  // for an abort that starts when the time is up

/// What has appeared since the dive began, as the ground truth sees it.
class ChangedWorld {
 public:
  explicit ChangedWorld(const planning::RobotHull& hull) : hull_(hull) {}

  void add(std::span<const SeenObstacle> seen) {
    keep();
    for (planning::Obstacle& obstacle : as_obstacles(seen, world_.obstacles.size())) {
      world_.obstacles.push_back(std::move(obstacle));
    }
    meter_.emplace(world_, hull_);
  }
  void observe(const Pose& X_WB) {
    if (meter_) meter_->observe(X_WB);
  }
  [[nodiscard]] double min_clearance_m() const {
    return meter_ ? std::min(before_.min_clearance_m, meter_->min_clearance_m())
                  : before_.min_clearance_m;
  }
  [[nodiscard]] int collisions() const {
    return before_.collisions + (meter_ ? meter_->collisions() : 0);
  }

 private:
  void keep() { before_ = {min_clearance_m(), collisions()}; }

  const planning::RobotHull& hull_;
  planning::World world_;
  std::optional<vehicle::ClearanceMeter> meter_;
  Touched before_;
};

/// Who else is in the water.
class Company {
 public:
  Company(const std::optional<vehicle::DiverTrack>& track, const planning::RobotHull& hull) {
    if (!track) return;
    diver_.emplace(*track);
    planning::World alone;
    alone.obstacles.push_back(vehicle::Diver::shape());
    meter_.emplace(alone, hull);
  }

  void observe(Utime now, const Pose& X_WB) {
    if (!diver_) return;
    diver_->advance(now, X_WB.p);
    meter_->observe(diver_->pose().inverse() * X_WB);
  }
  [[nodiscard]] std::optional<Pose> pose() const {
    return diver_ ? std::optional(diver_->pose()) : std::nullopt;
  }
  [[nodiscard]] Touched touched() const {
    return meter_ ? Touched{meter_->min_clearance_m(), meter_->collisions()} : Touched{};
  }

 private:
  std::optional<vehicle::Diver> diver_;
  std::optional<vehicle::ClearanceMeter> meter_;
};

/// What a vehicle in unknown water sees and makes of it.
class Eyes {
 public:
  Eyes(const planning::RobotHull& hull, const DiveSettings& settings,
       const planning::MapperOptions& options, std::optional<vehicle::RangeCamera> camera)
      : camera_(std::move(camera)),
        mapper_(hull, options,
                settings.mapper_latency_ticks * from_seconds(vehicle::Simulator::kTick)) {}

  void look(const vehicle::GroundTruth& truth, const std::optional<Pose>& X_WD,
            const estimation::StateEstimate& estimate, bool is_frozen) {
    mapper_.observe(estimate);
    if (!camera_) return;
    camera_->set_frozen(is_frozen);
    if (camera_->due(truth.utime)) {
      mapper_.submit(camera_->take(truth.utime, truth.X_WB, X_WD), truth.utime);
    }
  }
  /// What was made of pictures.
  void look(std::optional<RangeScan> scan, Utime now) {
    if (scan) mapper_.submit(std::move(*scan), now);
  }
  [[nodiscard]] MapperService& mapper() { return mapper_; }

 private:
  std::optional<vehicle::RangeCamera> camera_;  ///< None where the cameras are the eyes.
  MapperService mapper_;
};

vehicle::StereoCameraOptions cameras_of(const Mission& mission, const DiveSettings& settings) {
  return settings.cameras.value_or(*vehicle::stereo_camera_in(mission.water));
}

/// The eyes of the mission, if it needs any, and what makes sweeps of pictures, if that does.
struct Sighted {
  std::unique_ptr<Eyes> eyes;
  RangeMaker make_range;
};

Sighted eyes_for(const Mission& mission, const planning::World& world,
                 const planning::RobotHull& hull, const DiveSettings& settings) {
  Sighted sighted;
  if (!mission.unknown) return sighted;
  planning::MapperOptions options = mapper_options(mission, settings.mapper);
  std::optional<vehicle::RangeCamera> camera;
  if (has_stereo_eyes(mission)) {
    const vehicle::StereoCameraOptions cameras = cameras_of(mission, settings);
    auto eyes = stereo_eyes(cameras.camera(0), cameras.camera(1), options);
    DIVE_DEMAND(eyes);
    sighted.make_range = std::move(eyes->make_range);
    options = eyes->mapper;
  } else {
    camera.emplace(world, settings.range_camera, settings.seed);
  }
  sighted.eyes = std::make_unique<Eyes>(hull, settings, options, std::move(camera));
  return sighted;
}

std::optional<SimulatedSight> sight_for(const Mission& mission, const planning::World& world,
                                        const DiveSettings& settings, RangeMaker make_range) {
  if (!goes_by_sight(mission)) return std::nullopt;
  SightSettings of_sight;
  of_sight.cameras = cameras_of(mission, settings);
  of_sight.make_range = std::move(make_range);
  of_sight.tags = known_tags(mission, world);
  of_sight.cameras.tags = settings.tags.value_or(of_sight.tags);
  of_sight.latency = settings.vision_latency_ticks * from_seconds(vehicle::Simulator::kTick);
  of_sight.loops =
      loop_settings(mission, settings.loop_latency_ticks * from_seconds(vehicle::Simulator::kTick));
  return std::optional<SimulatedSight>(std::in_place, world, of_sight, settings.conditions,
                                       settings.seed);
}

vehicle::Conditions conditions_of(const DiveSettings& settings, bool has_sight) {
  vehicle::Conditions conditions = settings.conditions;
  if (has_sight && !conditions.inertial_unit) conditions.inertial_unit = vehicle::ImuNoise{};
  return conditions;
}

/// What is told of the estimates of a dive.
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
  estimation::StateEstimate last_;  ///< Not valid before the first one.
};

ExecutiveOptions executive_options(const DiveSettings& settings) {
  ExecutiveOptions options;
  options.seed = settings.seed;
  options.resume = settings.resume;
  return options;
}

/// Has the vehicle been in one place for a while, by ground truth?
class Rest {
 public:
  [[nodiscard]] double seconds(const vehicle::GroundTruth& truth) {
    if (since_ < 0 || (truth.X_WB.p - place_W_).norm() > kSamePlace) {
      place_W_ = truth.X_WB.p;
      since_ = truth.utime;
    }
    return to_seconds(truth.utime - since_);
  }

 private:
  Eigen::Vector3d place_W_ = Eigen::Vector3d::Zero();
  Utime since_ = -1;
};

void finish(DiveResult& result, const ExecutiveResult& executive, const StepOutputs& last,
            const vehicle::GroundTruth& truth, const Touched& touched) {
  result.outcome = to_string(executive.outcome);
  result.final_state = executive.final_state;
  result.rung = last.status.rung;
  result.cause = executive.cause;
  result.duration_s = to_seconds(truth.utime);
  result.distance_m = truth.distance_swum_m;
  result.energy_wh = truth.energy_used_wh;
  result.final_depth_m = -truth.X_WB.p.z();
  result.min_clearance_m = touched.min_clearance_m;
  result.collisions = touched.collisions;
  result.estimate_error_m = (last.estimate.X_WB.p - truth.X_WB.p).norm();
  result.estimate_sigma_m = std::sqrt(last.estimate.covariance.topLeftCorner<3, 3>().trace());
  if (executive.outcome == Outcome::kRunning) {
    result.outcome = "failure";
    result.cause =
        fmt::format("still in state {} after {:.0f} s", executive.final_state, result.duration_s);
  }
  if (result.collisions > 0) {
    result.outcome = "failure";
    result.cause = fmt::format("{} collision(s) with the map", result.collisions);
  }
}

}  // namespace

Pose start_pose(const Mission& mission, const planning::World& world) {
  const planning::Scene scene(world);
  return Pose{mission.start.in_world(ground_height(scene, mission.start)),
              from_rpy(0.0, 0.0, heading_to_yaw(mission.start_heading_deg))};
}

std::vector<Tag> known_tags(const Mission& mission, const planning::World& world) {
  std::vector<Tag> tags;
  if (mission.tags.empty()) return tags;
  const planning::Scene scene(world);
  for (const TagSpec& spec : mission.tags) {
    Tag tag;
    tag.id = spec.id.value;
    tag.size_m = spec.size_m;
    tag.X_WT.p = spec.position.in_world(ground_height(scene, spec.position));
    tag.X_WT.q = tag_attitude(heading_to_yaw(spec.heading_deg), deg_to_rad(spec.pitch_deg),
                              deg_to_rad(spec.roll_deg));
    tag.sigma_m = spec.sigma_m;
    tag.sigma_deg = spec.sigma_deg;
    tags.push_back(tag);
  }
  return tags;
}

std::string DiveSettings::validate() const {
  if (planner_latency_ticks < 1) return "planner_latency_ticks must be at least 1";
  if (mapper_latency_ticks < 1) return "mapper_latency_ticks must be at least 1";
  if (vision_latency_ticks < 1) return "vision_latency_ticks must be at least 1";
  if (loop_latency_ticks < 1) return "loop_latency_ticks must be at least 1";
  if (cameras) {
    if (std::string problem = cameras->validate(); !problem.empty()) return problem;
  }
  if (std::string problem = conditions.validate(); !problem.empty()) return problem;
  if (std::string problem = range_camera.validate(); !problem.empty()) return problem;
  if (std::string problem = mapper.validate(); !problem.empty()) return problem;
  if (diver) {
    if (std::string problem = diver->validate(); !problem.empty()) return problem;
  }
  return planner.validate();
}

double longest_dive_s(const Mission& mission) {
  return 1.5 * mission.limits.mission_timeout.value + kGraceSeconds;
}

DiveResult simulate_dive(const Mission& mission, const planning::World& world,
                         const vehicle::Model& model, const DiveSettings& settings,
                         const DiveObserver& observer, const DiveKeeper& keeper) {
  const Utime tick = from_seconds(vehicle::Simulator::kTick);
  const Pose start = settings.resume ? settings.resume->committed.X_WB : start_pose(mission, world);
  auto [eyes, make_range] = eyes_for(mission, world, model.hull, settings);
  std::optional<SimulatedSight> sight = sight_for(mission, world, settings, std::move(make_range));
  vehicle::Simulator simulator(model, start, conditions_of(settings, sight.has_value()),
                               settings.seed);
  vehicle::ClearanceMeter meter(world, model.hull);
  FaultInjector injector(settings.faults);
  ChangedWorld changed(model.hull);
  Company company(settings.diver, model.hull);
  const planning::World known = known_world(mission, world);
  PlannerService planner(known, model.hull, planner_options(mission, settings.planner),
                         settings.planner_latency_ticks * tick);
  Executive executive(mission, known, model, executive_options(settings));

  DiveResult result;
  EstimateWatch watch(result);
  StepOutputs outputs;
  Rest rest;
  bool held = false;
  const double longest = longest_dive_s(mission);
  while (to_seconds(simulator.truth().utime) < longest &&
         executive.result().outcome == Outcome::kRunning) {
    const vehicle::SensorSamples samples = simulator.step(outputs.rates);
    const vehicle::GroundTruth& truth = simulator.truth();
    StepInputs inputs;
    inputs.now = truth.utime;
    inputs.imu = samples.imu;
    inputs.depth = samples.depth;
    inputs.health = samples.health;
    inputs.plan = planner.poll(truth.utime);
    if (eyes) inputs.map_update = eyes->mapper().poll(truth.utime);
    if (sight) inputs.vision = sight->poll(truth.utime);
    if (eyes && sight) eyes->look(sight->take_scan(), truth.utime);
    if (settings.script) settings.script({inputs, injector, simulator});
    injector.apply(truth, inputs);
    if (!inputs.seen.empty()) {
      planner.add(inputs.seen);
      changed.add(inputs.seen);
    }
    if (inputs.map_update) {
      planner.apply(*inputs.map_update);
      static_cast<void>(result.seen.apply(*inputs.map_update));
    }
    meter.observe(truth.X_WB);
    changed.observe(truth.X_WB);
    company.observe(truth.utime, truth.X_WB);
    if (settings.sensor_observer) settings.sensor_observer(samples, truth, company.pose());
    outputs = executive.step(inputs);
    watch.observe(outputs.estimate);
    if (eyes) {
      eyes->look(truth, company.pose(), outputs.estimate, injector.is_on(FaultKind::kRangeFrozen));
    }
    if (sight) {
      sight->hear(samples.inertial, inputs.depth, injector);
      sight->look(truth, company.pose(), injector, outputs.estimate);
    }
    if (keeper) keeper(executive, outputs);
    if (outputs.plan_query) {
      ++result.plans;
      if (!outputs.plan_query->request.previous.empty()) ++result.replans;
      planner.submit(*outputs.plan_query, truth.utime);
    }
    for (const TransitionRecord& record : outputs.transitions) {
      result.transitions.push_back({to_seconds(truth.utime), record});
    }
    result.failsafes.insert(result.failsafes.end(), outputs.failsafes.begin(),
                            outputs.failsafes.end());
    if (observer) observer(inputs, outputs, truth);
    const bool kept = outputs.status.rung != "none" && outputs.status.rung != "warn";
    const double rested_s = rest.seconds(truth);
    if (settings.rest_s > 0.0 && kept && rested_s >= settings.rest_s) {
      held = true;
      break;
    }
  }
  finish(result, executive.result(), outputs, simulator.truth(),
         {std::min({meter.min_clearance_m(), changed.min_clearance_m(),
                    company.touched().min_clearance_m}),
          meter.collisions() + changed.collisions() + company.touched().collisions});
  if (eyes) result.seen_points = eyes->mapper().points();
  if (held && result.collisions == 0) result.outcome = "held";
  return result;
}

}  // namespace dive::mission
