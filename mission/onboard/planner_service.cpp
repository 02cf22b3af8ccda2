#include "mission/onboard/planner_service.h"

#include <exception>
#include <utility>

namespace dive::mission {
namespace {

constexpr double kAround =
    12.0;  // m: observed obstacles so near to start and goal are planned with

}  // namespace

PlannerService::PlannerService(const planning::World& world, const planning::RobotHull& hull,
                               const planning::PlannerOptions& options, Utime latency, OnLate late)
    : hull_(hull),
      options_(options),
      known_(world),
      world_(world),
      planner_(std::make_unique<planning::Planner>(world_, hull_, options_, clock_)),
      latency_(latency),
      worker_(late) {}

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
  worker_.start(now + latency_,
                [this, query = std::move(query), map = map_] { return answer(query, map); });
}

// Observed obstacles far from start and goal are left out, because there may be many.
void PlannerService::renew_planner(const planning::PlanRequest& request,
                                   const planning::ObservedMap& map) {
  Eigen::AlignedBox3d ends(request.start.p);
  ends.extend(request.goal.p);
  const bool is_wide_enough = map.pieces() == 0 || added_within_.contains(ends);
  if (map.revision() == revision_ && is_wide_enough) return;
  const Eigen::Vector3d around = Eigen::Vector3d::Constant(kAround);
  added_within_ = {ends.min() - around, ends.max() + around};
  world_ = planning::without(known_, map.absent());
  map.append_within(added_within_, world_.obstacles);
  planner_ = std::make_unique<planning::Planner>(world_, hull_, options_, clock_);
  revision_ = map.revision();
}

std::optional<PlanReply> PlannerService::poll(Utime now) {
  if (!next_) return worker_.poll(now);
  if (worker_.has_finished()) launch(*std::exchange(next_, std::nullopt), now);
  return std::nullopt;
}

// On the worker.
PlanReply PlannerService::answer(const PlanQuery& query, const planning::ObservedMap& map) {
  PlanReply reply;
  reply.id = query.id;
  try {
    renew_planner(query.request, map);
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
