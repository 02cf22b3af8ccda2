#include "planning/planner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "planning/world/scene.h"

namespace dive::planning {
namespace {

constexpr double kRounding = 1e-9;    // m: what a bound may lose by arithmetic
constexpr double kStartGrace = 0.02;  // m: what a start in a tight place may lose at first
constexpr int kMaxRefinements = 2;    // of one attempt
constexpr int kHeadingsTried = 8;     // at a goal whose attitude is free

/// Adds the time from its construction to its destruction to a total.
class Stopwatch {
 public:
  Stopwatch(Clock& clock, double& total_ms)
      : clock_(clock), total_ms_(total_ms), start_(clock.now()) {}
  ~Stopwatch() { total_ms_ += static_cast<double>(clock_.now() - start_) * 1e-3; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  Clock& clock_;
  double& total_ms_;
  Utime start_;
};

PlanResult invalid(std::string reason) {
  PlanResult result;
  result.status = PlanStatus::kInvalid;
  result.reason = std::move(reason);
  return result;
}

double length_of(std::span<const Pose> waypoints) {
  double length = 0.0;
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    length += (waypoints[i].p - waypoints[i - 1].p).norm();
  }
  return length;
}

// The rest of a path that was being followed, from where the vehicle is now.
std::vector<Pose> continued(const PlanRequest& request) {
  std::vector<Pose> path = request.previous;
  path.front() = request.start;
  path.back().p = request.goal.p;
  return path;
}

void halve_segment(std::vector<Pose>& waypoints, int segment) {
  const auto i = static_cast<std::size_t>(segment);
  if (i + 1 >= waypoints.size()) return;
  const Pose middle = interpolate(waypoints[i], waypoints[i + 1], 0.5);
  waypoints.insert(waypoints.begin() + segment + 1, middle);
}

}  // namespace

const char* to_string(PlanStatus status) {
  switch (status) {
    case PlanStatus::kSuccess:
      return "success";
    case PlanStatus::kNoPath:
      return "no_path";
    case PlanStatus::kInvalid:
      return "invalid";
  }
  return "invalid";
}

std::string PlannerOptions::validate() const {
  if (!(waypoint_spacing_m >= 0.1 && waypoint_spacing_m <= 10.0)) {
    return "waypoint_spacing_m must be from 0.1 to 10 m";
  }
  if (max_warm_starts < 0 || max_warm_starts > 100) return "max_warm_starts must be from 0 to 100";
  return {};
}

struct Planner::Impl {
  const World& world;
  const RobotHull& hull;
  PlannerOptions options;
  Clock& clock;
  Scene scene;
  Trajopt trajopt;
  Certifier certifier;

  Impl(const World& world_in, const RobotHull& hull_in, PlannerOptions options_in, Clock& clock_in)
      : world(world_in),
        hull(hull_in),
        options(options_in),
        clock(clock_in),
        scene(world_in),
        trajopt(scene, hull_in, options.trajopt),
        certifier(world_in, hull_in, options.certify) {}

  struct Attempt {
    TrajoptResult path;
    Certificate certificate;
  };

  PlanResult plan(const PlanRequest& request);
  PlanResult search(const PlanRequest& request, double start_clearance, StageTimes& times);
  Attempt attempt(const PlanRequest& request, std::vector<Pose> initial, double start_clearance,
                  StageTimes& times, int& iterations);
  bool keeps_clearance(const PlanRequest& request, double start_clearance, const Attempt& attempt);
  std::optional<std::vector<Pose>> warm_start(const PlanRequest& request,
                                              std::vector<VirtualObstacle>& avoid, int number);
  WarmStartOptions warm_start_options(const PlanRequest& request, int number) const;

  std::string problem_with(const PlanRequest& request);
  double clearance_at(const Pose& pose) { return certify_at(pose).clearance_m; }
  Certificate certify_at(const Pose& pose) { return certifier.certify(std::span(&pose, 1)); }
  Certificate certify_goal(const PlanRequest& request);
  std::string name_of(int obstacle) const {
    return obstacle < 0 ? "nothing" : world.obstacles[static_cast<std::size_t>(obstacle)].name;
  }
};

// The goal's clearance at the attitude asked for, or at the best heading where it is free.
Certificate Planner::Impl::certify_goal(const PlanRequest& request) {
  Certificate best = certify_at(request.goal);
  if (request.goal_attitude_fixed) return best;
  const double yaw = to_rpy(request.goal.q).z();
  for (int i = 1; i < kHeadingsTried && best.clearance_m < request.clearance; ++i) {
    const Eigen::Quaterniond q = from_rpy(0.0, 0.0, yaw + 2.0 * M_PI * i / kHeadingsTried);
    const Certificate certificate = certify_at(Pose{request.goal.p, q});
    if (certificate.clearance_m > best.clearance_m) best = certificate;
  }
  return best;
}

// Empty, or why the question makes no sense.
std::string Planner::Impl::problem_with(const PlanRequest& request) {
  const auto finite = [](const Pose& pose) {
    return pose.is_finite() && std::abs(pose.q.norm() - 1.0) < 1e-6;
  };
  if (!finite(request.start)) return "the start is not a finite pose";
  if (!finite(request.goal)) return "the goal is not a finite pose";
  if (!std::all_of(request.previous.begin(), request.previous.end(), finite)) {
    return "the previous path has a pose that is not finite";
  }
  if (!(request.clearance >= 0.0 && request.clearance <= options.certify.cutoff)) {
    return fmt::format("the clearance must be from 0 to {:g} m", options.certify.cutoff);
  }
  if (request.goal.p.z() > request.max_z) {
    return fmt::format("the goal (z = {:.2f} m) is above {:.2f} m", request.goal.p.z(),
                       request.max_z);
  }
  if (request.goal.p.z() < request.min_z) {
    return fmt::format("the goal (z = {:.2f} m) is below {:.2f} m", request.goal.p.z(),
                       request.min_z);
  }
  const Certificate start = certify_at(request.start);
  if (start.clearance_m <= 0.0) {
    return fmt::format("the start is in collision with {}", name_of(start.obstacle));
  }
  const Certificate goal = certify_goal(request);
  if (goal.clearance_m <= 0.0) {
    return fmt::format("the goal is in collision with {}", name_of(goal.obstacle));
  }
  if (goal.clearance_m < request.clearance - options.certify.tolerance) {
    return fmt::format("the goal is {:.2f} m from {}, nearer than the clearance of {:.2f} m",
                       goal.nearest_m, name_of(goal.obstacle), request.clearance);
  }
  return {};
}

// A vehicle that finds itself nearer to something than D_min must be let out: up to the first
// waypoint that has D_min again the motion may not come nearer than the start already is.
bool Planner::Impl::keeps_clearance(const PlanRequest& request, double start_clearance,
                                    const Attempt& attempt) {
  const double required = request.clearance - kRounding;
  if (attempt.certificate.clearance_m >= required) return true;
  if (start_clearance >= request.clearance ||
      attempt.certificate.clearance_m < start_clearance - kStartGrace) {
    return false;
  }
  const std::span<const Pose> waypoints = attempt.path.waypoints;
  std::size_t clear = 0;
  while (clear < waypoints.size() && clearance_at(waypoints[clear]) < required) ++clear;
  return clear < waypoints.size() &&
         certifier.certify(waypoints.subspan(clear)).clearance_m >= required;
}

Planner::Impl::Attempt Planner::Impl::attempt(const PlanRequest& request, std::vector<Pose> initial,
                                              double start_clearance, StageTimes& times,
                                              int& iterations) {
  TrajoptProblem problem;
  problem.start = request.start;
  problem.goal = request.goal;
  problem.goal_attitude_fixed = request.goal_attitude_fixed;
  problem.attitude = request.attitude;
  problem.clearance = request.clearance;
  problem.min_z = request.min_z;
  problem.max_z = request.max_z;
  Attempt result;
  for (int refinement = 0;; ++refinement) {
    {
      const Stopwatch stopwatch(clock, times.optimise_ms);
      result.path = trajopt.optimise(problem, initial);
    }
    iterations += result.path.iterations;
    const Stopwatch stopwatch(clock, times.certify_ms);
    result.certificate = certifier.certify(result.path.waypoints);
    // The optimiser is content and the certificate is not: the chord between two waypoints hides
    // something, and a waypoint there shows it.
    const bool chord = result.path.violation_m < options.trajopt.clearance_buffer &&
                       !keeps_clearance(request, start_clearance, result);
    if (!chord || refinement == kMaxRefinements) return result;
    initial = result.path.waypoints;
    halve_segment(initial, result.certificate.segment);
  }
}

WarmStartOptions Planner::Impl::warm_start_options(const PlanRequest& request, int number) const {
  WarmStartOptions result;
  // Below D_min, and lower with every try: what the search lets through the optimiser may widen.
  result.check_radius = request.clearance * std::max(0.3, 0.9 - 0.1 * number);
  result.preferred_clearance = std::max(request.clearance, result.check_radius) + 0.25;
  result.min_z = request.min_z;
  result.max_z = std::min(request.max_z, -result.check_radius);
  return result;
}

std::optional<std::vector<Pose>> Planner::Impl::warm_start(const PlanRequest& request,
                                                           std::vector<VirtualObstacle>& avoid,
                                                           int number) {
  WarmStart search(world, warm_start_options(request, number));
  const std::uint64_t seed = request.seed + static_cast<std::uint64_t>(number);
  auto positions =
      search.plan(request.start.p, request.goal.p, avoid, options.waypoint_spacing_m, seed);
  if (!positions && !avoid.empty()) {
    avoid.clear();  // the virtual obstacles may have closed the only way
    positions =
        search.plan(request.start.p, request.goal.p, avoid, options.waypoint_spacing_m, seed);
  }
  if (!positions || positions->size() < 2) return std::nullopt;
  return poses_along(*positions, request.start, request.goal, request.attitude);
}

PlanResult Planner::Impl::search(const PlanRequest& request, double start_clearance,
                                 StageTimes& times) {
  PlanResult result;
  result.status = PlanStatus::kNoPath;
  result.clearance_m = -std::numeric_limits<double>::infinity();
  int nearest_obstacle = -1;
  bool connected = true;
  std::vector<VirtualObstacle> avoid;
  std::vector<Pose> initial = request.previous.size() >= 2
                                  ? continued(request)
                                  : straight_line(request.start, request.goal, request.attitude,
                                                  options.waypoint_spacing_m);
  for (int number = 0;; ++number) {
    const Attempt tried =
        attempt(request, std::move(initial), start_clearance, times, result.iterations);
    if (tried.certificate.clearance_m > result.clearance_m) {
      result.waypoints = tried.path.waypoints;
      result.clearance_m = tried.certificate.clearance_m;
      nearest_obstacle = tried.certificate.obstacle;
    }
    bool good = false;
    {
      const Stopwatch stopwatch(clock, times.certify_ms);
      good = keeps_clearance(request, start_clearance, tried);
    }
    if (good) {
      result.status = PlanStatus::kSuccess;
      result.waypoints = tried.path.waypoints;
      result.clearance_m = tried.certificate.clearance_m;
      break;
    }
    if (number == options.max_warm_starts) break;
    // The paper's loop: where it hurts most nothing may pass, for the sampling planner only.
    const auto& cost = tried.path.waypoint_cost;
    const auto worst = std::max_element(cost.begin(), cost.end()) - cost.begin();
    if (!cost.empty()) {
      avoid.push_back({tried.path.waypoints[static_cast<std::size_t>(worst)].p, request.clearance});
    }
    const Stopwatch stopwatch(clock, times.warm_start_ms);
    std::optional<std::vector<Pose>> next = warm_start(request, avoid, number);
    if (!next) {
      connected = false;
      break;
    }
    ++result.warm_starts;
    initial = std::move(*next);
  }
  result.length_m = length_of(result.waypoints);
  if (result.status == PlanStatus::kNoPath) {
    result.reason =
        connected
            ? fmt::format("no path found that keeps {:.2f} m: the best keeps {:.2f} m, nearest {}",
                          request.clearance, std::max(result.clearance_m, 0.0),
                          name_of(nearest_obstacle))
            : fmt::format("blocked: there is no way to the goal, and {} is in the straight one",
                          name_of(nearest_obstacle));
  }
  return result;
}

PlanResult Planner::Impl::plan(const PlanRequest& request) {
  StageTimes times;
  PlanResult result;
  {
    const Stopwatch stopwatch(clock, times.total_ms);
    double start_clearance = 0.0;
    std::string problem;
    {
      const Stopwatch certifying(clock, times.certify_ms);
      problem = problem_with(request);
      if (problem.empty()) start_clearance = clearance_at(request.start);
    }
    result = problem.empty() ? search(request, start_clearance, times) : invalid(problem);
  }
  result.times = times;
  return result;
}

Planner::Planner(const World& world, const RobotHull& hull, PlannerOptions options, Clock& clock)
    : impl_(std::make_unique<Impl>(world, hull, options, clock)) {}
Planner::Planner(Planner&&) noexcept = default;
Planner::~Planner() = default;

PlanResult Planner::plan(const PlanRequest& request) { return impl_->plan(request); }

Certificate Planner::certify(std::span<const Pose> waypoints) {
  return impl_->certifier.certify(waypoints);
}

}  // namespace dive::planning
