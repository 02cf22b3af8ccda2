#include "mission/simulation/faults.h"

#include <algorithm>
#include <array>
#include <limits>

namespace dive::mission {
namespace {

constexpr std::array<std::string_view, kFaultCount> kNames = {
    "leak",          "battery",        "temperature",    "imu_silent",
    "imu_nan",       "depth_silent",   "depth_nan",      "depth_frozen",
    "health_silent", "planner_fails",  "planner_silent", "blocked",
    "abort",         "range_silent",   "range_frozen",   "camera_blackout",
    "camera_frozen", "camera_missing", "camera_blur",    "camera_right_missing",
    "depth_wild"};

constexpr double kStep = 0.25;   // m between remembered places
constexpr double kBehind = 2.0;  // m back along the trail, where something falls
constexpr double kApart = 1.5;   // m from the vehicle at least: what falls onto it is no obstacle
constexpr double kEdge = 0.6;    // m, of the cube that does
constexpr double kHot = 90.0;    // degrees Celsius
constexpr double kWild = 3.0;    // m
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

std::string_view to_string(FaultKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

std::optional<FaultKind> find_fault(std::string_view name) {
  const auto found = std::ranges::find(kNames, name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<FaultKind>(found - kNames.begin());
}

FaultInjector::FaultInjector(std::vector<Fault> faults)
    : faults_(std::move(faults)), begun_(faults_.size(), false) {}

void FaultInjector::add(const Fault& fault) {
  faults_.push_back(fault);
  begun_.push_back(false);
}

bool FaultInjector::is_on(FaultKind kind) const {
  return std::ranges::any_of(faults_, [&](const Fault& fault) {
    return fault.kind == kind && now_s_ >= fault.at_s && now_s_ < fault.at_s + fault.for_s;
  });
}

// True once for every fault of that kind.
bool FaultInjector::begins(FaultKind kind) {
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    if (faults_[i].kind != kind || begun_[i] || now_s_ < faults_[i].at_s) continue;
    begun_[i] = true;
    return true;
  }
  return false;
}

void FaultInjector::apply(const vehicle::GroundTruth& truth, StepInputs& inputs,
                          std::vector<AppearingObstacle>& appearing) {
  now_s_ = to_seconds(truth.utime);
  const Eigen::Vector3d& p_W = truth.X_WB.p;
  if (been_W_.empty() || (p_W - been_W_.back()).norm() >= kStep) been_W_.push_back(p_W);
  if (static_cast<double>(been_W_.size()) * kStep > kBehind + kStep) been_W_.pop_front();
  spoil_sensors(inputs);
  spoil_plan(inputs);
  const bool is_apart = (been_W_.front() - p_W).norm() >= kApart;
  if (is_apart && begins(FaultKind::kBlocked)) drop_something(appearing);
  if (begins(FaultKind::kAbort)) inputs.operator_command = OperatorCommand::kAbort;
}

void FaultInjector::apply(vehicle::InertialSamples& samples) const {
  if (is_on(FaultKind::kImuSilent)) samples.count = 0;
  if (!is_on(FaultKind::kImuNan)) return;
  for (ImuSample& sample : samples.samples) sample.gyro_B.x() = kNan;
}

void FaultInjector::spoil_sensors(StepInputs& inputs) {
  if (inputs.health) {
    if (is_on(FaultKind::kLeak)) inputs.health->leak = true;
    if (is_on(FaultKind::kBattery)) inputs.health->battery_fraction = 0.0;
    if (is_on(FaultKind::kTemperature)) inputs.health->temperature_c = kHot;
  }
  if (is_on(FaultKind::kHealthSilent)) inputs.health.reset();
  if (is_on(FaultKind::kRangeSilent)) drop_scans(inputs);
  if (is_on(FaultKind::kImuSilent)) inputs.imu.reset();
  if (is_on(FaultKind::kImuNan) && inputs.imu) inputs.imu->q_WB.w() = kNan;
  if (inputs.depth) spoil_depth(inputs);
}

void FaultInjector::drop_scans(StepInputs& inputs) {
  std::erase_if(inputs.obstacles, [](const planning::ObstacleUpdate& update) {
    return update.source == planning::ObstacleSource::kMapper;
  });
  inputs.free_ahead.reset();
  inputs.obstacle_ahead.reset();
  inputs.pose_correction.reset();
  inputs.map_correction.reset();
  inputs.map_fix.reset();
}

void FaultInjector::spoil_depth(StepInputs& inputs) {
  double& depth_m = inputs.depth->depth_m;
  if (!is_on(FaultKind::kDepthFrozen)) frozen_.reset();
  if (is_on(FaultKind::kDepthFrozen)) {
    if (!frozen_) frozen_ = inputs.depth;
    depth_m = frozen_->depth_m;
  }
  if (is_on(FaultKind::kDepthWild)) {
    depth_m += wild_up_ ? kWild : -kWild;
    wild_up_ = !wild_up_;
  }
  if (is_on(FaultKind::kDepthNan)) depth_m = kNan;
  if (is_on(FaultKind::kDepthSilent)) inputs.depth.reset();
}

void FaultInjector::spoil_plan(StepInputs& inputs) const {
  if (!inputs.plan) return;
  if (is_on(FaultKind::kPlannerFails)) {
    planning::PlanResult& plan = inputs.plan->plan;
    plan.status = planning::PlanStatus::kNoPath;
    plan.accepted = false;
    plan.reason = "injected: nothing is found any more";
    plan.reduced.reset();
    plan.waypoints.clear();
  }
  if (is_on(FaultKind::kPlannerSilent)) inputs.plan.reset();
}

void FaultInjector::drop_something(std::vector<AppearingObstacle>& appearing) {
  AppearingObstacle obstacle;
  obstacle.X_WO.p = been_W_.front();
  obstacle.size.setConstant(kEdge);
  appearing.push_back(obstacle);
}

}  // namespace dive::mission
