#include "planning/planner.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "planning/path_search.h"
#include "planning/stopwatch.h"
#include "planning/world/scene.h"

namespace dive::planning {
namespace {

constexpr int kHeadingsTried = 8;      // at a goal whose attitude is free
constexpr int kMaxGoalMoves = 30;      // of a goal within its tolerance
constexpr double kGoalMargin = 0.005;  // m beyond D_min

PlanResult invalid(std::string reason) {
  PlanResult result;
  result.status = PlanStatus::kInvalid;
  result.reason = std::move(reason);
  return result;
}

bool is_finite(const Pose& pose) {
  return pose.is_finite() && std::abs(pose.q.norm() - 1.0) < 1e-6;
}

}  // namespace

std::string PlannerOptions::validate() const {
  if (!(waypoint_spacing_m >= 0.1 && waypoint_spacing_m <= 10.0)) {
    return "waypoint_spacing_m must be from 0.1 to 10 m";
  }
  if (!(information_weight >= 0.0 && information_weight <= 100.0)) {
    return "information_weight must be from 0 to 100";
  }
  if (max_warm_starts < 0 || max_warm_starts > 100) return "max_warm_starts must be from 0 to 100";
  return {};
}

struct Planner::Impl {
  PlannerOptions options;
  Clock& clock;
  std::vector<Eigen::Vector3d> hull_vertices;
  Scene scene;
  PathSearch search;
  PlannerStatistics statistics;  // of the last plan

  Impl(const World& world, const RobotHull& hull, const PlannerOptions& options_in, Clock& clock_in)
      : options(options_in),
        clock(clock_in),
        hull_vertices(hull.hull_vertices()),
        scene(world),
        search(world, scene, hull, options, clock) {}

  PlanResult plan(PlanRequest request);

  std::string question_problem(const PlanRequest& request) const;
  std::string place_problem(PlanRequest& request, double& start_clearance);
  Certificate certify_at(const Pose& pose) {
    return search.certifier().certify(std::span(&pose, 1));
  }
  Certificate choose_heading(PlanRequest& request);
  bool move_goal(PlanRequest& request);
};

// Checks that need no map. Empty, or the reason why the request is invalid.
std::string Planner::Impl::question_problem(const PlanRequest& request) const {
  if (!is_finite(request.start)) return "the start is not a finite pose";
  if (!is_finite(request.goal)) return "the goal is not a finite pose";
  if (!std::all_of(request.previous.begin(), request.previous.end(), is_finite)) {
    return "the previous path has a pose that is not finite";
  }
  if (!std::all_of(request.trail.begin(), request.trail.end(), is_finite)) {
    return "the trail has a pose that is not finite";
  }
  if (!(request.limits.clearance >= 0.0 && request.limits.clearance <= options.certify.cutoff)) {
    return fmt::format("the clearance must be from 0 to {:g} m", options.certify.cutoff);
  }
  if (!(request.limits.reduced_clearance >= 0.0))
    return "the reduced clearance must not be negative";
  if (!(request.limits.goal_tolerance >= 0.0 &&
        request.limits.goal_tolerance <= kMaxGoalTolerance)) {
    return fmt::format("the goal's tolerance must be from 0 to {:g} m", kMaxGoalTolerance);
  }
  if (!(request.limits.min_altitude >= 0.0 && request.limits.min_altitude <= kMaxAltitude)) {
    return fmt::format("the altitude must be from 0 to {:g} m", kMaxAltitude);
  }
  const double z = request.goal.p.z();
  if (z > request.limits.max_z) {
    return fmt::format("the goal (z = {:.2f} m) is above {:.2f} m", z, request.limits.max_z);
  }
  if (z < request.limits.min_z) {
    return fmt::format("the goal (z = {:.2f} m) is below {:.2f} m", z, request.limits.min_z);
  }
  return {};
}

// Sets the heading with most clearance if the goal's attitude is free. Returns the certificate of
// the goal with that heading.
Certificate Planner::Impl::choose_heading(PlanRequest& request) {
  Certificate best = certify_at(request.goal);
  if (request.goal_attitude_fixed) return best;
  const double yaw = to_rpy(request.goal.q).z();
  for (int i = 1; i < kHeadingsTried && best.clearance_m < request.limits.clearance; ++i) {
    Pose turned = request.goal;
    turned.q = from_rpy(0.0, 0.0, yaw + 2.0 * M_PI * i / kHeadingsTried);
    const Certificate certificate = certify_at(turned);
    if (certificate.clearance_m <= best.clearance_m) continue;
    best = certificate;
    request.goal.q = turned.q;
  }
  return best;
}

// Away from what is nearest, within the tolerance. True when that gives the goal its clearance.
bool Planner::Impl::move_goal(PlanRequest& request) {
  const Eigen::Vector3d given = request.goal.p;
  std::vector<Eigen::Vector3d> points(hull_vertices.size());
  std::vector<Contact> contacts;
  for (int move = 0; move < kMaxGoalMoves; ++move) {
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = request.goal * hull_vertices[i];
    scene.contacts(points, request.limits.clearance + kGoalMargin, contacts);
    if (contacts.empty()) return certify_at(request.goal).clearance_m >= request.limits.clearance;
    const auto nearest = std::min_element(
        contacts.begin(), contacts.end(),
        [](const Contact& a, const Contact& b) { return a.distance < b.distance; });
    request.goal.p +=
        (request.limits.clearance + 2.0 * kGoalMargin - nearest->distance) * nearest->normal_W;
    request.goal.p.z() = std::clamp(request.goal.p.z(), request.limits.min_z, request.limits.max_z);
    const Eigen::Vector3d off = request.goal.p - given;
    if (off.norm() > request.limits.goal_tolerance) {
      request.goal.p = given + request.limits.goal_tolerance * off.normalized();
    }
  }
  return certify_at(request.goal).clearance_m >= request.limits.clearance;
}

// Checks start and goal in the map. Empty, or the reason; a goal may be moved within its tolerance.
std::string Planner::Impl::place_problem(PlanRequest& request, double& start_clearance) {
  const Certificate start = certify_at(request.start);
  start_clearance = start.clearance_m;
  if (start.clearance_m <= 0.0) {
    return fmt::format("the start is in collision with {}", search.name_of(start.obstacle));
  }
  const Certificate goal = choose_heading(request);
  if (goal.clearance_m >= request.limits.clearance - options.certify.tolerance) return {};
  const Pose given = request.goal;
  if (request.limits.goal_tolerance > 0.0 && move_goal(request)) return {};
  request.goal = given;
  if (goal.clearance_m <= 0.0) {
    return fmt::format("the goal is in collision with {}", search.name_of(goal.obstacle));
  }
  return fmt::format("the goal is {:.2f} m from {}, nearer than the clearance of {:.2f} m",
                     goal.nearest_m, search.name_of(goal.obstacle), request.limits.clearance);
}

PlanResult Planner::Impl::plan(PlanRequest request) {
  statistics = {};
  PlanResult result;
  {
    const Stopwatch stopwatch(clock, statistics.total_ms);
    std::string problem = question_problem(request);
    double start_clearance = 0.0;
    if (problem.empty()) {
      const Stopwatch certifying(clock, statistics.certify_ms);
      problem = place_problem(request, start_clearance);
    }
    result = problem.empty() ? search.run(request, start_clearance, statistics) : invalid(problem);
  }
  result.accepted = result.status == PlanStatus::kSuccess ||
                    (result.status == PlanStatus::kReduced &&
                     result.clearance_m >= request.limits.reduced_clearance);
  return result;
}

Planner::Planner(const World& world, const RobotHull& hull, const PlannerOptions& options,
                 Clock& clock)
    : impl_(std::make_unique<Impl>(world, hull, options, clock)) {}
Planner::Planner(Planner&&) noexcept = default;
Planner::~Planner() = default;

PlanResult Planner::plan(const PlanRequest& request) { return impl_->plan(request); }
const PlannerStatistics& Planner::statistics() const { return impl_->statistics; }

Certificate Planner::certify(std::span<const Pose> waypoints) {
  return impl_->search.certifier().certify(waypoints);
}

}  // namespace dive::planning
