#include "mission/executive/planner_service.h"

#include <exception>
#include <utility>

#include "common/priority.h"
#include "mission/executive/changed_map.h"

namespace dive::mission {
namespace {

constexpr double kAround = 12.0;  // m: seen pieces so near to start and goal are planned with

}  // namespace

PlannerService::PlannerService(const planning::World& world, const planning::RobotHull& hull,
                               planning::PlannerOptions options, Utime latency, Late late)
    : world_(world),
      hull_(hull),
      options_(std::move(options)),
      known_(world_.obstacles.size()),
      planner_(std::make_unique<planning::Planner>(world_, hull_, options_, clock_)),
      latency_(latency),
      late_(late) {}

void PlannerService::add(std::span<const SeenObstacle> seen) {
  for (planning::Obstacle& obstacle : as_obstacles(seen, seen_)) {
    added_.push_back(std::move(obstacle));
  }
  seen_ += seen.size();
}

void PlannerService::submit(PlanQuery query, Utime now) {
  if (late_ == Late::kNotYet && is_busy(result_)) {
    next_ = std::move(query);
  } else {
    launch(std::move(query), now);
  }
}

void PlannerService::launch(PlanQuery query, Utime now) {
  if (result_.valid()) result_.wait();  // one planner, one plan at a time
  id_ = query.id;
  due_ = now + latency_;
  take_updates();
  if (!added_.empty()) {
    is_renewed_ = false;
    world_.obstacles.resize(known_);
    world_.obstacles.insert(world_.obstacles.end(), added_.begin(), added_.end());
    known_ = world_.obstacles.size();
    added_.clear();
  }
  result_ = std::async(std::launch::async, [this, request = std::move(query.request)] {
    run_as_others();  // a plan may come late, a command may not
    renew_planner(request);
    return planner_->plan(request);
  });
}

void PlannerService::apply(const planning::MapUpdate& update) {
  updates_.push_back(update);
  if (!is_busy(result_)) take_updates();
}

// While the worker rests.
void PlannerService::take_updates() {
  for (const planning::MapUpdate& update : updates_) {
    const bool is_taken = seen_map_.apply(update);
    if (is_taken && !update.cells.empty()) is_renewed_ = false;
  }
  updates_.clear();
}

// What was seen far from the way is left out: there may be much of it.
void PlannerService::renew_planner(const planning::PlanRequest& request) {
  Eigen::AlignedBox3d way(request.start.p);
  way.extend(request.goal.p);
  const bool is_wide_enough = seen_map_.pieces() == 0 || renewed_within_.contains(way);
  if (is_renewed_ && is_wide_enough) return;
  const Eigen::Vector3d around = Eigen::Vector3d::Constant(kAround);
  renewed_within_ = {way.min() - around, way.max() + around};
  world_.obstacles.resize(known_);
  seen_map_.append_within(renewed_within_, world_.obstacles);
  planner_ = std::make_unique<planning::Planner>(world_, hull_, options_, clock_);
  is_renewed_ = true;
}

std::optional<PlanReply> PlannerService::poll(Utime now) {
  if (!result_.valid() || (late_ == Late::kNotYet && is_busy(result_))) return std::nullopt;
  if (next_) {  // what is ready is an answer to a question that nobody asks any more
    launch(*std::exchange(next_, std::nullopt), now);
    return std::nullopt;
  }
  if (now < due_) return std::nullopt;
  return reply();
}

PlanReply PlannerService::reply() {
  PlanReply reply;
  reply.id = id_;
  try {
    planning::PlanResult plan = result_.get();
    reply.status = plan.status;
    reply.reason = std::move(plan.reason);
    if (plan.status == planning::PlanStatus::kSuccess) reply.waypoints = std::move(plan.waypoints);
    reply.clearance_m = plan.clearance_m;
    reply.length_m = plan.length_m;
    reply.warm_starts = plan.warm_starts;
  } catch (const std::exception& error) {
    // A mistake of ours in the planner is a failed plan, and the planner-failure failsafe's
    // business; the vehicle goes on holding station.
    reply.status = planning::PlanStatus::kInvalid;
    reply.reason = error.what();
  }
  return reply;
}

}  // namespace dive::mission
