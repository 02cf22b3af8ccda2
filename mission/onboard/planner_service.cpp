#include "mission/onboard/planner_service.h"

#include <exception>
#include <utility>

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
      worker_(late) {}

void PlannerService::add(std::span<const SeenObstacle> seen) {
  for (planning::Obstacle& obstacle : as_obstacles(seen, seen_)) {
    added_.push_back(std::move(obstacle));
  }
  seen_ += seen.size();
}

void PlannerService::submit(PlanQuery query, Utime now) {
  if (worker_.may_start()) {
    launch(std::move(query), now);
  } else {
    next_ = std::move(query);
  }
}

void PlannerService::launch(PlanQuery query, Utime now) {
  worker_.collect();
  worker_.drop_waiting();  // answers to earlier requests
  take_updates();
  if (!added_.empty()) {
    is_renewed_ = false;
    world_.obstacles.resize(known_);
    world_.obstacles.insert(world_.obstacles.end(), added_.begin(), added_.end());
    known_ = world_.obstacles.size();
    added_.clear();
  }
  worker_.start(now + latency_, [this, query = std::move(query)] { return answer(query); });
}

void PlannerService::apply(const planning::MapUpdate& update) {
  updates_.push_back(update);
  if (worker_.has_finished()) take_updates();
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
  if (!next_) return worker_.poll(now);
  if (worker_.has_finished()) launch(*std::exchange(next_, std::nullopt), now);
  return std::nullopt;
}

// On the worker.
PlanReply PlannerService::answer(const PlanQuery& query) {
  PlanReply reply;
  reply.id = query.id;
  try {
    renew_planner(query.request);
    reply.plan = planner_->plan(query.request);
    if (!reply.plan.accepted) reply.plan.waypoints.clear();  // the log has no use for them
  } catch (const std::exception& error) {
    // A mistake of ours in the planner is a failed plan, and the planner-failure failsafe's
    // business; the vehicle goes on holding station.
    reply.plan = {};
    reply.plan.reason = error.what();
  }
  return reply;
}

}  // namespace dive::mission
