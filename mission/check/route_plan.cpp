#include "mission/check/route_plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/clock.h"
#include "mission/executive/behavior_factory.h"
#include "planning/certify/certify.h"

namespace dive::mission {
namespace {

std::string shown(const Eigen::Vector3d& p_W) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", p_W.x(), p_W.y(), p_W.z());
}

void report_reduced(const RouteLeg& leg, const planning::PlanResult& plan, const Mission& mission,
                    Diagnostics& diagnostics) {
  const std::string accepted =
      std::isfinite(leg.reduced_clearance)
          ? fmt::format("the mission accepts {:g} m", leg.reduced_clearance)
          : "the mission accepts no reduced clearance";
  diagnostics.error("CHK-PLAN", mission.source, leg.span,
                    fmt::format("the path to goal '{}' is reduced: {}; narrowest at {}; {}",
                                leg.goal.id, plan.reason, shown(plan.reduced->place_W), accepted),
                    "move the start of the leg, or state the least clearance that is accepted: "
                    "reduced_clearance=\"...\" here or in limits");
}

}  // namespace

RouteRequests::RouteRequests(const Route& route, std::uint64_t seed)
    : route_(route), settings_(route.settings), at_(route.start) {
  settings_.seed = seed;
  trail_.add(at_.p, true);
}

const planning::PlanRequest& RouteRequests::next() {
  DIVE_DEMAND(leg_ < route_.legs.size());
  const RouteLeg& leg = route_.legs[leg_++];
  at_.p = leg.from_W;
  settings_.limits.reduced_clearance = leg.reduced_clearance;
  request_ = behaviors::leg_request(settings_, leg.goal, at_, &trail_);
  return request_;
}

void RouteRequests::arrive(const std::vector<Pose>& path) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double length = (path[i].p - path[i - 1].p).norm();
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / behaviors::kTrailSpacing)));
    for (int k = 1; k <= pieces; ++k) {
      constexpr bool kIsOpen = true;  // does not matter here
      trail_.add(interpolate(path[i - 1], path[i], static_cast<double>(k) / pieces).p, kIsOpen);
    }
  }
  at_ = path.empty() ? request_.goal : path.back();
}

std::vector<PlannedRouteLeg> plan_route(const Route& route, const Mission& mission,
                                        const planning::World& world,
                                        const planning::RobotHull& hull,
                                        const planning::PlannerOptions& options, std::uint64_t seed,
                                        const RouteObserver& planned) {
  SteadyClock clock;
  planning::Planner planner(world, hull, planner_options(mission, world, options), clock);
  std::vector<PlannedRouteLeg> legs;
  RouteRequests requests(route, seed);
  for (const RouteLeg& leg : route.legs) {
    planning::PlanResult plan = planner.plan(requests.next());
    requests.arrive(plan.waypoints);
    legs.push_back({leg.state, leg.goal.id, std::move(plan), planner.statistics()});
    if (planned) planned(legs.size());
  }
  return legs;
}

bool is_cut_off(double clearance_m) { return clearance_m >= planning::CertifyOptions{}.cutoff; }

std::string certified_text(double clearance_m, int decimals) {
  return fmt::format("{}{:.{}f} m", is_cut_off(clearance_m) ? "at least " : "", clearance_m,
                     decimals);
}

void report_failed_plans(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                         const Mission& mission, Diagnostics& diagnostics) {
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const planning::PlanResult& plan = legs[i].plan;
    if (plan.accepted) continue;
    if (plan.status == planning::PlanStatus::kReduced) {
      report_reduced(route.legs[i], plan, mission, diagnostics);
      continue;
    }
    diagnostics.error("CHK-PLAN", mission.source, route.legs[i].span,
                      fmt::format("no path to goal '{}' ({}): {}", legs[i].goal,
                                  planning::to_string(plan.status), plan.reason),
                      "move the goal, or lower the clearance in limits");
  }
}

}  // namespace dive::mission
