#include "mission/bundle/plan_proof.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "mission/check/route.h"
#include "mission/check/route_plan.h"
#include "planning/certify/certify.h"
#include "planning/world/scene.h"

namespace dive::mission {
namespace {

constexpr double kSamePlace = 1e-3;  // m
// Farther obstacles say nothing about the clearance asked for, and cost time.
constexpr double kBeyondAsked = 0.1;  // m

bool is_finite(const Pose& pose) { return pose.p.allFinite() && pose.q.coeffs().allFinite(); }

// What is wrong with a path before its clearance; empty if nothing is.
std::string problem_of(const std::vector<Pose>& path, const planning::PlanRequest& request) {
  if (path.size() < 2 || !std::ranges::all_of(path, is_finite)) return "its path is not valid";
  if ((path.front().p - request.start.p).norm() > kSamePlace) {
    return "its path does not begin where the leg does";
  }
  if ((path.back().p - request.goal.p).norm() > request.limits.goal_tolerance + kSamePlace) {
    return "its path does not lead to the goal";
  }
  const auto is_within = [&](const Pose& pose) {
    return pose.p.z() >= request.limits.min_z - kSamePlace &&
           pose.p.z() <= request.limits.max_z + kSamePlace;
  };
  return std::ranges::all_of(path, is_within) ? "" : "its path leaves the limits of depth";
}

// The least clearance (m) that is accepted of a plan.
double required(const planning::PlanResult& plan, const planning::PlanRequest& request,
                double tolerance) {
  const double asked = plan.status == planning::PlanStatus::kReduced
                           ? request.limits.reduced_clearance
                           : request.limits.clearance;
  const double claimed = std::min(plan.clearance_m, request.limits.clearance);
  return std::max(asked, claimed) - tolerance;
}

}  // namespace

tl::expected<PlanProof, std::string> prove_plans(const std::vector<BundledLeg>& legs,
                                                 const Mission& mission,
                                                 const planning::World& world,
                                                 const planning::RobotHull& hull) {
  const planning::Scene scene(world);
  const Route route = nominal_route(mission, scene);
  if (legs.size() != route.legs.size()) {
    return tl::unexpected(
        fmt::format("it has {} plans for a route of {} legs", legs.size(), route.legs.size()));
  }
  const planning::CertifyOptions options;
  planning::Certifier certifier(world, hull, options);
  PlanProof proof{legs.size(), std::numeric_limits<double>::infinity()};
  RouteRequests requests(route, 0);
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const auto& [state, goal, asked, plan] = legs[i];
    const auto refuse = [&, &name = goal](const std::string& why) {
      return tl::unexpected(fmt::format("the plan to '{}': {}", name, why));
    };
    const RouteLeg& leg = route.legs[i];
    if (state != leg.state || goal != leg.goal.id) {
      return refuse(fmt::format("the route leads to '{}' in state '{}'", leg.goal.id, leg.state));
    }
    const planning::PlanRequest& request = requests.next();
    if (!plan.accepted || !planning::has_path(plan.status)) return refuse("it was not accepted");
    if (const std::string why = problem_of(plan.waypoints, request); !why.empty()) {
      return refuse(why);
    }
    const planning::Certificate certificate = certifier.certify(
        plan.waypoints, request.limits.clearance + kBeyondAsked, request.limits.clearance);
    const double least = required(plan, request, options.tolerance);
    if (!(certificate.clearance_m >= least)) {
      return refuse(fmt::format("{:.3f} m of clearance is proved, and it claims {:.3f} m",
                                certificate.clearance_m, least + options.tolerance));
    }
    requests.arrive(plan.waypoints);
    proof.clearance_m = std::min(proof.clearance_m, certificate.clearance_m);
  }
  return proof;
}

}  // namespace dive::mission
