#include "mission/onboard/onboard_dive.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "common/assert.h"
#include "mission/executive/behavior_factory.h"
#include "mission/executive/map_updates.h"
#include "mission/onboard/stereo_mapping.h"

namespace dive::mission {
namespace {

constexpr std::uint64_t kTrackerStream = 0x7ac4;  // the tracker draws by itself

}  // namespace

OnboardDive::OnboardDive(const Mission& mission, const planning::World& world,
                         const vehicle::Model& model, const OnboardSettings& settings,
                         const std::optional<estimation::VisionOptions>& vision, OnLate late)
    : mission_(mission),
      world_(known_world(mission, world)),
      model_(model),
      settings_(settings),
      swept_hull_(model.hull),
      planner_(world_, model.hull, planner_options(mission, world_, settings.planner),
               settings.planner_latency_ticks * kControlPeriod, late) {
  planning::MapperOptions mapping = mapper_options(mission, settings.mapper);
  if (uses_visual_inertial(mission)) {
    DIVE_DEMAND(vision.has_value());
    make_vision(world, *vision, mapping, late);
  }
  const bool maps = mapping_sensor(mission) != MappingSensor::kNone;
  std::shared_ptr<const planning::MapSurface> known;
  if (!mission.unknown && (maps || uses_map_fixes(mission))) {
    known = std::make_shared<const planning::MapSurface>(world_);
  }
  if (maps) {
    mapper_.emplace(model.hull, mapping, known, settings.mapper_latency_ticks * kControlPeriod,
                    late);
  }
  if (uses_map_fixes(mission)) {
    std::shared_ptr<const planning::ObjectCells> objects;
    if (mission.trusts_absence) {
      objects = std::make_shared<const planning::ObjectCells>(world_, *known);
    }
    matcher_.emplace(known, objects, mapping.noise, settings.fix_latency_ticks * kControlPeriod,
                     late);
  }
}

void OnboardDive::make_vision(const planning::World& world, const estimation::VisionOptions& vision,
                              planning::MapperOptions& mapping, OnLate late) {
  estimation::VisionOptions options = vision;
  options.tags = known_tags(mission_, world);
  RangeMaker make_range;
  if (maps_with_stereo(mission_)) {
    const std::vector<CameraModel>& cameras = options.filter.cameras;
    auto stereo =
        stereo_mapping(cameras.at(0), cameras.at(1), mapping, mission_.unknown.has_value());
    DIVE_DEMAND(stereo);
    make_range = std::move(stereo->make_range);
    mapping = stereo->mapper;
  }
  vision_.emplace(options, settings_.seed ^ kTrackerStream,
                  settings_.vision_latency_ticks * kControlPeriod, late, std::move(make_range),
                  loop_settings(mission_, settings_.loop_latency_ticks * kControlPeriod),
                  settings_.resume ? settings_.resume->checkpoint.imu_bias : std::nullopt);
}

OnboardReport OnboardDive::run(VehiclePort& port, const DiveKeeper& keeper) {
  ExecutiveOptions options;
  options.seed = settings_.seed;
  options.resume = settings_.resume;
  executive_.emplace(mission_, world_, model_, options);
  report_ = {};
  map_ = {};
  has_position_ = false;
  Utime now = began_ = port.begin();
  const Utime longest = from_seconds(longest_dive_s(mission_));
  while (executive_->result().outcome == Outcome::kRunning && now - began_ < longest) {
    const std::optional<Utime> tick = port.wait_for_tick();
    if (!tick) break;
    now = *tick;
    step(port, now, keeper);
  }
  report_.executive = executive_->result();
  report_.observed_map = map_;
  if (mapper_) report_.observed_points = mapper_->points();
  return std::move(report_);
}

void OnboardDive::step(VehiclePort& port, Utime now, const DiveKeeper& keeper) {
  StepInputs inputs;
  inputs.now = now;
  port.sense(inputs);
  ask_services(inputs);
  port.amend(inputs);
  if (has_position_ && settings_.local_abort) {
    if (const auto abort = settings_.local_abort()) inputs.operator_command = abort;
  }
  update_map(map_, inputs);
  planner_.set_map(map_);
  if (mapper_) mapper_->set_absent(map_.absent());
  const StepOutputs& outputs = executive_->step(inputs);
  has_position_ = outputs.estimate.valid;
  if (vision_ && vision_->imu_bias()) executive_->keep_imu_bias(*vision_->imu_bias());
  if (keeper) keeper(*executive_, outputs);
  port.command(outputs);
  port.keep_exit_path(executive_->exit_path(), map_);
  feed_services(port, inputs, outputs);
  report(outputs, now);
  port.end_tick(inputs, outputs);
}

void OnboardDive::ask_services(StepInputs& inputs) {
  inputs.plan = planner_.poll(inputs.now);
  if (mapper_) take_scan_result(inputs);
  if (matcher_) {
    inputs.map_fix = matcher_->poll(inputs.now);
    if (auto change = matcher_->take_absences()) inputs.obstacles.push_back(*std::move(change));
  }
  if (vision_) {
    inputs.vision = vision_->poll(inputs.now);
    if (auto correction = vision_->take_map_correction()) {
      mapper_->move(*std::move(correction), inputs.now);
    }
  }
  inputs.obstacle_ahead = std::exchange(obstacle_ahead_, std::nullopt);
  note_failures(inputs.now);
}

void OnboardDive::note_failures(Utime now) {
  const auto note = [&](const char* service, const std::optional<std::string>& message) {
    if (!message || report_.service_failures.size() == kMaxServiceFailures) return;
    report_.service_failures.push_back({to_seconds(now - began_), service, *message});
  };
  if (mapper_) note("mapper", mapper_->take_failure());
  if (matcher_) note("map fixes", matcher_->take_failure());
  if (vision_) note("visual-inertial estimator", vision_->take_failure());
}

void OnboardDive::take_scan_result(StepInputs& inputs) {
  auto [result, moved] = mapper_->poll(inputs.now);
  if (moved) {
    inputs.obstacles.push_back(std::move(moved->obstacles));
    inputs.map_correction = std::move(moved->correction);
  }
  if (!result) return;
  if (!result->obstacles.cells.empty()) inputs.obstacles.push_back(std::move(result->obstacles));
  inputs.pose_correction = result->correction;
  if (result->correction && vision_) vision_->align(result->correction->correction_W);
  // Where the map is known, what no scan has observed is not unknown.
  if (mission_.unknown) inputs.free_ahead = result->free_ahead;
}

// A scan and a pair of images are placed by the estimate of the time when they were taken, so that
// the services get this tick's estimate first.
void OnboardDive::feed_services(VehiclePort& port, const StepInputs& inputs,
                                const StepOutputs& outputs) {
  if (mapper_) mapper_->observe(outputs.estimate);
  if (matcher_) matcher_->observe(outputs.estimate);
  std::optional<RangeScan> scan;
  if (uses_range_camera(mission_)) scan = port.take_scan();
  if (scan) watch_the_way(*scan, outputs.estimate);
  if (scan && matcher_) matcher_->submit(*scan, inputs.now);
  if (scan && mapping_sensor(mission_) == MappingSensor::kRangeCamera) {
    mapper_->submit(std::move(*scan), inputs.now, obstacle_ahead_);
  }
  if (mapper_ && vision_) {
    if (auto stereo = vision_->take_scan()) {
      if (matcher_) matcher_->submit(*stereo, inputs.now);
      mapper_->submit(std::move(*stereo), inputs.now);
    }
  }
  if (vision_) {
    vision_->add(port.take_imu_samples());
    if (inputs.depth) vision_->add(*inputs.depth);
    vision_->observe(outputs.estimate);
    auto [left, right] = port.take_images();
    vision_->submit(std::move(left), std::move(right), inputs.now);
  }
  if (outputs.plan_query) planner_.submit(*outputs.plan_query, inputs.now);
}

// A frozen sensor repeats what was ahead once.
void OnboardDive::watch_the_way(const RangeScan& scan, const estimation::StateEstimate& estimate) {
  if (!estimate.valid || scan_check_.check(scan) != planning::ScanProblem::kNone) return;
  const std::vector<Pose> way_W = executive_->way_ahead(planning::SweptHull::kHorizon);
  // At its full speed, so that it does not set off towards what it has stopped for.
  const double speed = std::max(mission_.speed.value, estimate.v_WB_B.norm());
  obstacle_ahead_ = swept_hull_.first_obstacle(scan, way_W, speed);
}

void OnboardDive::report(const StepOutputs& outputs, Utime now) {
  if (outputs.plan_query) {
    ++report_.plans;
    if (!outputs.plan_query->request.previous.empty()) ++report_.replans;
  }
  for (const TransitionRecord& record : outputs.transitions) {
    report_.transitions.push_back({to_seconds(now - began_), record});
  }
  report_.failsafes.insert(report_.failsafes.end(), outputs.failsafes.begin(),
                           outputs.failsafes.end());
}

}  // namespace dive::mission
