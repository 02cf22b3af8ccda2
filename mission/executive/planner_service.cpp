#include "mission/executive/planner_service.h"

#include <exception>
#include <utility>

#include "mission/executive/changed_map.h"

namespace dive::mission {

PlannerService::PlannerService(const planning::World& world, const planning::RobotHull& hull,
                               planning::PlannerOptions options, Utime latency)
    : world_(world),
      hull_(hull),
      options_(std::move(options)),
      planner_(std::make_unique<planning::Planner>(world_, hull_, options_, clock_)),
      latency_(latency) {}

void PlannerService::add(std::span<const SeenObstacle> seen) {
  if (result_.valid()) result_.wait();  // what is being planned is planned with what was known
  for (planning::Obstacle& obstacle : as_obstacles(seen, seen_)) {
    world_.obstacles.push_back(std::move(obstacle));
  }
  seen_ += seen.size();
  planner_ = std::make_unique<planning::Planner>(world_, hull_, options_, clock_);
}

void PlannerService::submit(PlanQuery query, Utime now) {
  if (result_.valid()) result_.wait();  // one planner, one plan at a time
  id_ = query.id;
  due_ = now + latency_;
  result_ = std::async(std::launch::async, [this, request = std::move(query.request)] {
    return planner_->plan(request);
  });
}

std::optional<PlanReply> PlannerService::poll(Utime now) {
  if (!result_.valid() || now < due_) return std::nullopt;
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
