#include "planning/path_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "planning/stopwatch.h"

namespace dive::planning {
namespace {

constexpr double kRounding = 1e-9;        // m: what a bound may lose by arithmetic
constexpr int kMaxRefinements = 3;        // of one attempt
constexpr double kSmallViolation = 0.05;  // m: likely of a chord, not of a roll
constexpr double kShortestSegment = 0.3;  // m: shorter ones are not split
constexpr double kRollGain = 0.15;        // m: what lying on its side can gain a vehicle
constexpr double kPreferred = 0.25;       // m beyond the ball, that warm starts like to have
constexpr double kBestTolerance = 0.02;   // of the best clearance that is looked for
constexpr int kBestTries = 9;
constexpr double kBeyond = 1.5;  // of the clearance asked for

void keep_better(PathSearch::Attempt&& other, PathSearch::Attempt& best) {
  if (other.certificate.clearance_m > best.certificate.clearance_m) best = std::move(other);
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

}  // namespace

PathSearch::PathSearch(const World& world, const RobotHull& hull, const PlannerOptions& options,
                       Clock& clock)
    : world_(world),
      options_(options),
      clock_(clock),
      scene_(world),
      trajopt_(scene_, hull, options.trajopt),
      certifier_(world, hull, options.certify),
      warm_start_(world),
      inner_radius_(hull.inner_radius()) {}

std::string PathSearch::name_of(int obstacle) const {
  return obstacle < 0 ? "nothing" : world_.obstacles[static_cast<std::size_t>(obstacle)].name;
}

// A vehicle that finds itself nearer to something than D_min must be let out: up to the first
// waypoint that has D_min again less will do. How much less does not depend on the start unless it
// has even less than that: else a vehicle that is planned for again and again gets nearer with
// every plan, and into a place where it cannot turn.
bool PathSearch::keeps_clearance(const Attempt& attempt) {
  const double required = problem_.clearance - kRounding;
  if (attempt.certificate.clearance_m >= required) return true;
  if (start_clearance_ >= problem_.clearance) return false;
  const double enough = kRoomAtStart * problem_.clearance;
  const double least = std::min(enough, start_clearance_) - options_.certify.tolerance;
  if (attempt.certificate.clearance_m < least) return false;

  const std::span<const Pose> waypoints = attempt.path.waypoints;
  std::size_t clear = 0;
  while (clear < waypoints.size() &&
         certifier_.certify(waypoints.subspan(clear, 1)).clearance_m < required) {
    ++clear;
  }
  if (start_clearance_ < enough &&
      length_of(waypoints.first(std::min(clear + 1, waypoints.size()))) > kWayToRoom) {
    return false;
  }
  return clear < waypoints.size() &&
         certifier_.certify(waypoints.subspan(clear)).clearance_m >= required;
}

// Not so deep in something that only another way helps.
bool PathSearch::within_reach(const Attempt& attempt) const {
  return attempt.path.violation_m < problem_.clearance + kRollGain;
}

// Waypoints where the path is short of clearance: a long segment is pushed away by what only its
// middle touches, and its turn is padded by what the chord may miss.
bool PathSearch::split(const Attempt& attempt, std::vector<Pose>& waypoints) const {
  std::vector<int> segments = attempt.path.tight_segments;
  if (segments.empty()) segments = {attempt.certificate.segment};
  waypoints = attempt.path.waypoints;
  bool any = false;
  for (auto segment = segments.rbegin(); segment != segments.rend(); ++segment) {
    const auto i = static_cast<std::size_t>(*segment);
    if (i + 1 >= waypoints.size()) continue;
    if ((waypoints[i + 1].p - waypoints[i].p).norm() < kShortestSegment) continue;
    const Pose middle = interpolate(waypoints[i], waypoints[i + 1], 0.5);
    waypoints.insert(waypoints.begin() + *segment + 1, middle);
    any = true;
  }
  return any;
}

PathSearch::Attempt PathSearch::optimise(std::span<const Pose> initial) {
  Attempt result;
  {
    const Stopwatch stopwatch(clock_, times_->optimise_ms);
    result.path = trajopt_.optimise(problem_, initial);
  }
  result_.iterations += result.path.iterations;
  const Stopwatch stopwatch(clock_, times_->certify_ms);
  result.certificate = certifier_.certify(result.path.waypoints);
  result.good = keeps_clearance(result);
  return result;
}

// Lies differently in narrow places, if that looks better for `path`.
void PathSearch::reroll(std::span<const Pose> path, Attempt& best) {
  if (best.good || !within_reach(best)) return;
  std::optional<std::vector<Pose>> rolled;
  {
    const Stopwatch stopwatch(clock_, times_->optimise_ms);
    rolled = trajopt_.other_rolls(problem_, path);
  }
  if (rolled) keep_better(optimise(*rolled), best);
}

void PathSearch::refine(int times, Attempt& best) {
  std::vector<Pose> finer;
  for (int time = 0; time < times; ++time) {
    if (best.good || !within_reach(best) || !split(best, finer)) return;
    keep_better(optimise(finer), best);
  }
}

// The optimiser from `initial`, and what helps it where it is not far from good, the likeliest
// first: more waypoints where it is tight, other rolls, more weight.
PathSearch::Attempt PathSearch::attempt(const std::vector<Pose>& initial) {
  problem_.escalate_below = 0.0;
  Attempt best = optimise(initial);
  if (best.path.violation_m < kSmallViolation) refine(1, best);
  reroll(best.path.waypoints, best);
  reroll(initial, best);
  problem_.escalate_below = problem_.clearance + kRollGain;
  if (!best.good && within_reach(best)) keep_better(optimise(best.path.waypoints), best);
  refine(kMaxRefinements, best);
  return best;
}

// Tries a path and keeps the best; true when it is what was asked for.
bool PathSearch::consider(const std::vector<Pose>& initial) {
  last_ = attempt(initial);
  if (last_.good || last_.certificate.clearance_m > result_.clearance_m) {
    result_.waypoints = last_.path.waypoints;
    result_.clearance_m = last_.certificate.clearance_m;
    nearest_ = last_.certificate.obstacle;
  }
  return last_.good;
}

std::optional<std::vector<Pose>> PathSearch::warm_start(int number) {
  const PlanRequest& request = *request_;
  WarmStartOptions search;
  search.check_radius = request.clearance + inner_radius_;
  search.preferred_clearance = search.check_radius + kPreferred;
  search.min_z = request.min_z;
  search.max_z = std::min(request.max_z, -request.clearance);
  warm_start_.set_options(search);
  const std::uint64_t seed = request.seed + static_cast<std::uint64_t>(number);
  const auto plan = [&] {
    return warm_start_.plan(request.start.p, request.goal.p, avoid_, options_.waypoint_spacing_m,
                            seed);
  };
  auto positions = plan();
  if (!positions && !avoid_.empty()) {
    avoid_.clear();  // the virtual obstacles may have closed the only way
    positions = plan();
  }
  if (!positions || positions->size() < 2) return std::nullopt;
  return poses_along(*positions, request.start, request.goal, request.attitude);
}

// The paper's loop: where it hurts most nothing may pass, for the sampling planner only.
bool PathSearch::search_warm_starts() {
  for (int number = 0; number < options_.max_warm_starts; ++number) {
    const auto& cost = last_.path.waypoint_cost;
    const auto worst = std::max_element(cost.begin(), cost.end()) - cost.begin();
    avoid_.push_back(
        {last_.path.waypoints[static_cast<std::size_t>(worst)].p, request_->clearance});
    std::optional<std::vector<Pose>> next;
    {
      const Stopwatch stopwatch(clock_, times_->warm_start_ms);
      next = warm_start(number);
    }
    if (!next) return false;
    ++result_.warm_starts;
    if (consider(*next)) return true;
  }
  return false;
}

// The last resort, and the judge: a way that a ball fits through, or the proof that there is none.
void PathSearch::search_widest() {
  const PlanRequest& request = *request_;
  const double enough = request.clearance + inner_radius_ + kPreferred;
  std::optional<WidestPath> widest;
  {
    const Stopwatch stopwatch(clock_, times_->warm_start_ms);
    widest =
        warm_start_.widest(request.start.p, request.goal.p, enough, options_.waypoint_spacing_m);
  }
  if (!widest) {
    result_.reason = why_not(false, 0.0);
    return;
  }
  ++result_.warm_starts;
  const double bound = widest->bound - inner_radius_;
  std::vector<Pose> initial =
      poses_along(widest->positions, request.start, request.goal, request.attitude);
  if (bound >= request.clearance && consider(initial)) {
    result_.status = PlanStatus::kSuccess;
    return;
  }
  search_best_clearance(std::move(initial), bound);
  if (result_.clearance_m >= request.clearance - kRounding) {
    result_.status = PlanStatus::kSuccess;
  } else {
    result_.reason = why_not(true, bound);
  }
}

// Bisection: what is found at one clearance starts the next. It begins beyond what is asked for:
// what cannot be had draws the path to the middle of a narrow place.
void PathSearch::search_best_clearance(std::vector<Pose> initial, double bound) {
  double high = std::clamp(bound, 0.0, kBeyond * request_->clearance);
  for (int number = 0; number < kBestTries; ++number) {
    const double low = std::max(result_.clearance_m, 0.0);
    if (low >= request_->clearance || high - low < kBestTolerance * high) break;
    problem_.clearance = number == 0 ? high : 0.5 * (low + high);
    if (!consider(initial)) high = problem_.clearance;
    if (last_.certificate.clearance_m > 0.0) initial = last_.path.waypoints;
  }
  problem_.clearance = request_->clearance;
}

std::string PathSearch::why_not(bool connected, double bound) const {
  if (!connected) {
    return fmt::format("blocked: there is no way to the goal, and {} is in the straight one",
                       name_of(nearest_));
  }
  const std::string best = result_.clearance_m > 0.0
                               ? fmt::format("the best found keeps {:.2f} m, nearest {}",
                                             result_.clearance_m, name_of(nearest_))
                               : fmt::format("all that were found touch {}", name_of(nearest_));
  if (bound < request_->clearance) {
    return fmt::format("too tight for {:.2f} m (more than {:.2f} m cannot be had); {}",
                       request_->clearance, std::max(bound, 0.0), best);
  }
  return fmt::format("no path found that keeps {:.2f} m; {}", request_->clearance, best);
}

PlanResult PathSearch::run(const PlanRequest& request, double start_clearance, StageTimes& times) {
  request_ = &request;
  times_ = &times;
  start_clearance_ = start_clearance;
  problem_.start = request.start;
  problem_.goal = request.goal;
  problem_.goal_attitude_fixed = request.goal_attitude_fixed;
  problem_.attitude = request.attitude;
  problem_.clearance = request.clearance;
  problem_.min_z = request.min_z;
  problem_.max_z = request.max_z;
  problem_.min_altitude = request.min_altitude;
  avoid_.clear();
  nearest_ = -1;
  result_ = {};
  result_.status = PlanStatus::kNoPath;
  result_.clearance_m = -std::numeric_limits<double>::infinity();
  const bool found = consider(request.previous.size() >= 2
                                  ? continued(request)
                                  : straight_line(request.start, request.goal, request.attitude,
                                                  options_.waypoint_spacing_m)) ||
                     search_warm_starts();
  if (found) {
    result_.status = PlanStatus::kSuccess;
  } else {
    search_widest();
  }
  result_.length_m = length_of(result_.waypoints);
  return std::move(result_);
}

}  // namespace dive::planning
