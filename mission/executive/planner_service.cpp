#include "mission/executive/planner_service.h"

#include <chrono>
#include <exception>
#include <utility>

#include "common/priority.h"
#include "mission/executive/changed_map.h"

namespace dive::mission {

PlannerService::PlannerService(const planning::World& world, const planning::RobotHull& hull,
                               planning::PlannerOptions options, Utime latency, Late late)
    : world_(world),
      hull_(hull),
      options_(std::move(options)),
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
  if (late_ == Late::kNotYet && is_busy()) {
    next_ = std::move(query);
  } else {
    launch(std::move(query), now);
  }
}

void PlannerService::launch(PlanQuery query, Utime now) {
  if (result_.valid()) result_.wait();  // one planner, one plan at a time
  id_ = query.id;
  due_ = now + latency_;
  result_ = std::async(std::launch::async, [this, request = std::move(query.request),
                                            added = std::exchange(added_, {})] {
    run_as_others();  // a plan may come late, a command may not
    if (!added.empty()) {
      world_.obstacles.insert(world_.obstacles.end(), added.begin(), added.end());
      planner_ = std::make_unique<planning::Planner>(world_, hull_, options_, clock_);
    }
    return planner_->plan(request);
  });
}

bool PlannerService::is_busy() const {
  return result_.valid() && result_.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
}

std::optional<PlanReply> PlannerService::poll(Utime now) {
  if (!result_.valid() || (late_ == Late::kNotYet && is_busy())) return std::nullopt;
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
    planning_ms_ += plan.times.total_ms;
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
