#include "planning/path_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "planning/stopwatch.h"

namespace dive::planning {
namespace {

constexpr int kMaxRefinements = 3;        // limit per attempt
constexpr double kSmallViolation = 0.05;  // m: probably caused by a chord, not by a roll
constexpr double kMinSegment = 0.3;       // m: shorter ones are not split
constexpr double kRollGain = 0.15;   // m: clearance that a vehicle can gain by lying on its side
constexpr double kPreferred = 0.25;  // m beyond the ball: preferred slack of warm starts
constexpr double kBestTolerance = 0.02;  // relative, in the search for the best clearance
constexpr int kBestTries = 12;
// factor on the optimiser's tolerances, in the search for the best clearance
constexpr double kFineness = 0.1;
constexpr double kBeyond = 1.5;         // factor on the requested clearance
constexpr std::size_t kLongPath = 160;  // waypoints; longer paths are optimised by stretches

// The rest of the path being followed, from the present position of the vehicle.
std::vector<Pose> continued(const PlanRequest& request) {
  std::vector<Pose> path = request.previous;
  path.front() = request.start;
  path.back().p = request.goal.p;
  return path;
}

// Breadcrumbs lie nearer to each other than waypoints.
std::vector<Pose> along_trail(const PlanRequest& request, double spacing) {
  std::vector<Eigen::Vector3d> positions = {request.start.p};
  for (const Pose& breadcrumb : request.trail) {
    if ((breadcrumb.p - positions.back()).norm() < spacing) continue;
    if ((breadcrumb.p - request.goal.p).norm() < 0.5 * spacing) break;
    positions.push_back(breadcrumb.p);
  }
  positions.push_back(request.goal.p);
  return poses_along(positions, request.start, request.goal, request.limits.attitude);
}

}  // namespace

PathSearch::PathSearch(const World& world, const Scene& scene, const RobotHull& hull,
                       const PlannerOptions& options, Clock& clock)
    : world_(world),
      options_(options),
      clock_(clock),
      scene_(scene),
      trajopt_(scene_, hull, options.trajopt),
      certifier_(world, hull, options.certify),
      warm_start_(scene, world.bounds()),
      inner_radius_(hull.inner_radius()) {}

void PathSearch::Attempt::keep_better(Attempt&& other) {
  if (other.good || other.certificate.clearance_m > certificate.clearance_m) {
    *this = std::move(other);
  }
}

std::string PathSearch::name_of(int obstacle) const {
  return obstacle < 0 ? "nothing" : world_.obstacles[static_cast<std::size_t>(obstacle)].name;
}

// True if the violation is small enough to be repaired without an alternative path.
bool PathSearch::within_reach(const Attempt& attempt) const {
  return attempt.path.violation_m < problem_.limits.clearance + kRollGain;
}

// Adds waypoints where the path is short of clearance: a long segment is pushed away by an obstacle
// that touches only its middle, and its turn is padded for the error of the chord.
bool PathSearch::split(const Attempt& attempt, std::vector<Pose>& waypoints) const {
  std::vector<int> segments = attempt.path.tight_segments;
  if (segments.empty()) segments = {attempt.certificate.segment};
  waypoints = attempt.path.waypoints;
  bool any = false;
  for (auto segment = segments.rbegin(); segment != segments.rend(); ++segment) {
    const auto i = static_cast<std::size_t>(*segment);
    if (i + 1 >= waypoints.size()) continue;
    if ((waypoints[i + 1].p - waypoints[i].p).norm() < kMinSegment) continue;
    const Pose middle = interpolate(waypoints[i], waypoints[i + 1], 0.5);
    waypoints.insert(waypoints.begin() + *segment + 1, middle);
    any = true;
  }
  return any;
}

Certificate PathSearch::certify(std::span<const Pose> path, double cutoff) {
  const Stopwatch stopwatch(clock_, statistics_->certify_ms);
  return certifier_.certify(path, cutoff, problem_.limits.clearance);
}

PathSearch::Attempt PathSearch::optimise(std::span<const Pose> initial) {
  Attempt result;
  {
    const Stopwatch stopwatch(clock_, statistics_->optimise_ms);
    result.path = trajopt_.optimise(problem_, initial);
  }
  statistics_->iterations += result.path.iterations;
  statistics_->waypoints_solved += result.path.waypoints_solved;
  if (is_provisional_ && result.path.is_clear) {
    result.good = true;
    return result;
  }
  result.certificate = certify(result.path.waypoints, cutoff_);
  result.good = keeps_clearance(result);
  return result;
}

// Changes the roll in narrow places, if that has a lower cost for `path`.
void PathSearch::reroll(std::span<const Pose> path, Attempt& best) {
  if (best.good || !within_reach(best)) return;
  std::optional<std::vector<Pose>> rolled;
  {
    const Stopwatch stopwatch(clock_, statistics_->optimise_ms);
    rolled = trajopt_.other_rolls(problem_, path);
  }
  if (rolled) best.keep_better(optimise(*rolled));
}

void PathSearch::refine(int times, Attempt& best) {
  std::vector<Pose> finer;
  for (int time = 0; time < times; ++time) {
    if (best.good || !within_reach(best) || !split(best, finer)) return;
    best.keep_better(optimise(finer));
  }
}

// Runs the optimiser from `initial`. If the result is nearly good, tries the likeliest remedy
// first: more waypoints in tight places, other rolls, more weight.
PathSearch::Attempt PathSearch::attempt_at_once(const std::vector<Pose>& initial) {
  problem_.escalate_below = 0.0;
  Attempt best = optimise(initial);
  if (best.path.violation_m < kSmallViolation) refine(1, best);
  reroll(best.path.waypoints, best);
  reroll(initial, best);
  problem_.escalate_below = problem_.limits.clearance + kRollGain;
  if (!best.good && within_reach(best)) best.keep_better(optimise(best.path.waypoints));
  refine(kMaxRefinements, best);
  return best;
}

TrajoptAssessment PathSearch::assess(std::span<const Pose> path) {
  const Stopwatch stopwatch(clock_, statistics_->optimise_ms);
  return trajopt_.assess(problem_, path);
}

PathSearch::Attempt PathSearch::attempt(const std::vector<Pose>& initial) {
  return initial.size() <= kLongPath ? attempt_at_once(initial) : attempt_by_stretches(initial);
}

// Tries a path and keeps the best; true if it meets the request.
bool PathSearch::consider(const std::vector<Pose>& initial) {
  last_ = attempt(initial);
  if (last_.good || last_.certificate.clearance_m > result_.clearance_m) take_last();
  return last_.good;
}

void PathSearch::take_last() {
  result_.waypoints = last_.path.waypoints;
  result_.clearance_m = last_.certificate.clearance_m;
  nearest_ = last_.certificate.obstacle;
}

std::optional<std::vector<Pose>> PathSearch::warm_start(std::vector<VirtualObstacle>& avoid,
                                                        int number) {
  WarmStartOptions search;
  search.check_radius = request_->limits.clearance + inner_radius_;
  search.preferred_clearance = search.check_radius + kPreferred;
  search.limits = request_->limits;
  warm_start_.set_options(search);
  const std::uint64_t seed = request_->seed + static_cast<std::uint64_t>(number);
  const auto plan = [&] {
    return warm_start_.plan(problem_.start.p, problem_.goal.p, avoid, options_.waypoint_spacing_m,
                            seed);
  };
  const Stopwatch stopwatch(clock_, statistics_->warm_start_ms);
  auto positions = plan();
  if (!positions && !avoid.empty()) {
    avoid.clear();  // the virtual obstacles may have closed the only path
    positions = plan();
  }
  if (!positions || positions->size() < 2) return std::nullopt;
  return poses_along(*positions, problem_.start, problem_.goal, problem_.limits.attitude);
}

// The loop of the AquaNav paper: the sampling planner must avoid the costliest waypoint.
PathSearch::Attempt PathSearch::attempt_around(
    Attempt failed, Attempt (PathSearch::*from)(const std::vector<Pose>&)) {
  std::vector<VirtualObstacle> avoid;
  Attempt best = failed;
  Attempt last = std::move(failed);
  for (int number = 0; number < options_.max_warm_starts && !best.good; ++number) {
    const auto& cost = last.path.waypoint_cost;
    const auto worst = std::max_element(cost.begin(), cost.end()) - cost.begin();
    avoid.push_back(
        {last.path.waypoints[static_cast<std::size_t>(worst)].p, request_->limits.clearance});
    const std::optional<std::vector<Pose>> next = warm_start(avoid, number);
    if (!next) break;
    ++result_.warm_starts;
    last = (this->*from)(*next);
    best.keep_better(Attempt(last));
  }
  return best;
}

bool PathSearch::search_warm_starts() {
  last_ = attempt_around(std::move(last_), &PathSearch::attempt);
  if (last_.good || last_.certificate.clearance_m > result_.clearance_m) take_last();
  return last_.good;
}

// The last resort: a path wide enough for a ball, or the proof that there is none.
bool PathSearch::search_widest() {
  const PlanRequest& request = *request_;
  const double enough = request.limits.clearance + inner_radius_ + kPreferred;
  std::optional<WidestPath> widest;
  {
    const Stopwatch stopwatch(clock_, statistics_->warm_start_ms);
    widest =
        warm_start_.widest(request.start.p, request.goal.p, enough, options_.waypoint_spacing_m);
  }
  if (!widest) {
    result_.reason = why_not(false, 0.0);
    return false;
  }
  ++result_.warm_starts;
  const double bound = widest->bound - inner_radius_;
  std::vector<Pose> initial =
      poses_along(widest->positions, request.start, request.goal, request.limits.attitude);
  if (bound >= request.limits.clearance && consider(initial)) return true;
  search_best_clearance(std::move(initial), bound);
  if (result_.clearance_m >= request.limits.clearance - kRounding) return true;
  result_.reason = why_not(true, bound);
  return false;
}

// Bisection, in which the best result starts the next attempt. It begins beyond the requested
// clearance, because an unattainable one draws the path to the middle of a narrow passage. From
// then on the optimiser's buffer is part of the target: short of it on both sides, every position
// between them costs the same, and the path does not stay in the middle. So the buffer is small
// here, and so are the steps.
void PathSearch::search_best_clearance(std::vector<Pose> initial, double bound) {
  TrajoptOptions finely = options_.trajopt;
  finely.clearance_buffer *= kFineness;
  finely.min_trust_region *= kFineness;
  finely.improvement_tolerance *= kFineness;
  trajopt_.set_options(finely);
  double high = std::clamp(bound, 0.0, kBeyond * request_->limits.clearance);
  double low = std::max(result_.clearance_m, 0.0);
  for (int number = 0; number < kBestTries; ++number) {
    if (result_.clearance_m >= request_->limits.clearance) break;
    if (high - low < kBestTolerance * high) break;
    const double hoped = number == 0 ? high + finely.clearance_buffer : 0.5 * (low + high);
    problem_.limits.clearance = std::max(hoped - finely.clearance_buffer, 0.0);
    last_ = attempt(initial);
    const double kept = last_.certificate.clearance_m;
    if (kept > result_.clearance_m) take_last();
    // A shortfall within the certificate's tolerance does not prove that there is no more
    // clearance.
    const bool had = kept >= (1.0 - kBestTolerance) * hoped - options_.certify.tolerance;
    if (!had) high = std::min(high, hoped);
    low = std::max({low, result_.clearance_m, had ? hoped : 0.0});
    if (result_.clearance_m > 0.0) initial = result_.waypoints;
  }
  problem_.limits.clearance = request_->limits.clearance;
  trajopt_.set_options(options_.trajopt);
}

std::string PathSearch::why_not(bool connected, double bound) const {
  if (!connected) {
    return fmt::format("blocked: no path leads to the goal; {} obstructs the straight one",
                       name_of(nearest_));
  }
  const std::string best = result_.clearance_m > 0.0
                               ? fmt::format("the best path found keeps {:.2f} m, nearest to {}",
                                             result_.clearance_m, name_of(nearest_))
                               : fmt::format("every path found touches {}", name_of(nearest_));
  if (bound < request_->limits.clearance) {
    return fmt::format("too narrow for a clearance of {:.2f} m (at most {:.2f} m is possible); {}",
                       request_->limits.clearance, std::max(bound, 0.0), best);
  }
  return fmt::format("no path found with a clearance of {:.2f} m; {}", request_->limits.clearance,
                     best);
}

PlanResult PathSearch::run(const PlanRequest& request, double start_clearance,
                           PlannerStatistics& statistics) {
  request_ = &request;
  statistics_ = &statistics;
  start_clearance_ = start_clearance;
  problem_.start = request.start;
  problem_.goal = request.goal;
  problem_.goal_attitude_fixed = request.goal_attitude_fixed;
  problem_.limits = request.limits;
  cutoff_ = options_.certify.cutoff;
  nearest_ = -1;
  result_ = {};
  result_.status = PlanStatus::kNoPath;
  result_.clearance_m = -std::numeric_limits<double>::infinity();
  const bool found =
      consider(request.previous.size() >= 2
                   ? continued(request)
                   : straight_line(request.start, request.goal, request.limits.attitude,
                                   options_.waypoint_spacing_m)) ||
      (request.trail.size() >= 2 && consider(along_trail(request, options_.waypoint_spacing_m))) ||
      search_warm_starts() || search_widest();
  if (found && options_.preferred_view) prefer_information();
  if (found) {
    classify();
  } else if (start_clearance_ < request.limits.clearance) {
    result_.reason +=
        fmt::format("; the start itself has a clearance of {:.2f} m", start_clearance_);
  }
  result_.length_m = path_length(result_.waypoints);
  return std::move(result_);
}

}  // namespace dive::planning
