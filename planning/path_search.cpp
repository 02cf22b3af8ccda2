#include "planning/path_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "planning/stopwatch.h"

namespace dive::planning {
namespace {

constexpr double kRounding = 1e-9;        // m: rounding error of a bound
constexpr int kMaxRefinements = 3;        // limit per attempt
constexpr double kSmallViolation = 0.05;  // m: probably caused by a chord, not by a roll
constexpr double kMinSegment = 0.3;       // m: shorter ones are not split
constexpr double kRollGain = 0.15;   // m: clearance that a vehicle can gain by lying on its side
constexpr double kPreferred = 0.25;  // m beyond the ball: preferred slack of warm starts
constexpr double kBestTolerance = 0.02;  // relative, in the search for the best clearance
constexpr int kBestTries = 12;
// factor on the optimiser's tolerances, in the search for the best clearance
constexpr double kFineness = 0.1;
constexpr double kBeyond = 1.5;            // factor on the requested clearance
constexpr double kNarrowTolerance = 0.01;  // m, on the length of a narrow part
constexpr std::size_t kLongPath = 160;     // waypoints; longer paths are optimised by stretches
constexpr int kMaxRounds = 3;              // rounds of optimising the joints between stretches
constexpr std::size_t kAround = 2;  // waypoints on either side from which a joint is assessed
constexpr std::size_t kWider = 8;   // waypoints by which a failed stretch grows

void keep_better(PathSearch::Attempt&& other, PathSearch::Attempt& best) {
  if (other.good || other.certificate.clearance_m > best.certificate.clearance_m) {
    best = std::move(other);
  }
}

double length_of(std::span<const Pose> waypoints) {
  double length = 0.0;
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    length += (waypoints[i].p - waypoints[i - 1].p).norm();
  }
  return length;
}

// The rest of the path being followed, from the present position of the vehicle.
std::vector<Pose> continued(const PlanRequest& request) {
  std::vector<Pose> path = request.previous;
  path.front() = request.start;
  path.back().p = request.goal.p;
  return path;
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

std::string PathSearch::name_of(int obstacle) const {
  return obstacle < 0 ? "nothing" : world_.obstacles[static_cast<std::size_t>(obstacle)].name;
}

// A vehicle nearer to an obstacle than D_min must be able to leave: up to the first waypoint with
// D_min, a smaller clearance is accepted. That clearance does not depend on the start unless the
// start has even less: otherwise repeated replanning brings the vehicle nearer with every plan, and
// into a place where it cannot turn.
bool PathSearch::keeps_clearance(const Attempt& attempt) {
  const double required = problem_.limits.clearance - kRounding;
  if (attempt.certificate.clearance_m >= required) return true;
  if (start_clearance_ >= problem_.limits.clearance) return false;
  const double enough = kMinStartClearance * problem_.limits.clearance;
  const double least = std::min(enough, start_clearance_) - options_.certify.tolerance;
  // Near contact the tolerance could exceed the clearance itself.
  if (attempt.certificate.clearance_m < least || attempt.certificate.clearance_m <= 0.0) {
    return false;
  }

  const std::span<const Pose> waypoints = attempt.path.waypoints;
  const std::size_t clear = first_clear(waypoints);
  if (start_clearance_ < enough &&
      length_of(waypoints.first(std::min(clear + 1, waypoints.size()))) > kMaxReducedLength) {
    return false;
  }
  return clear < waypoints.size() &&
         certify(waypoints.subspan(clear), options_.certify.cutoff).clearance_m >= required;
}

// The first waypoint with the clearance; the number of waypoints if there is none.
std::size_t PathSearch::first_clear(std::span<const Pose> waypoints) {
  std::size_t clear = 0;
  while (clear < waypoints.size() && certifier_.certify(waypoints.subspan(clear, 1)).clearance_m <
                                         problem_.limits.clearance - kRounding) {
    ++clear;
  }
  return clear;
}

// The narrow part of the path found. Its first clear waypoint ends a narrow segment, so the part
// short of the clearance ends somewhere on that segment.
NarrowPart PathSearch::narrow_part() {
  const std::span<const Pose> waypoints = result_.waypoints;
  const std::size_t clear = first_clear(waypoints);
  DIVE_DEMAND(clear > 0 && clear < waypoints.size());
  const Pose& from = waypoints[clear - 1];
  const Pose& to = waypoints[clear];
  double narrow = 0.0;
  double wide = 1.0;
  const double segment = (to.p - from.p).norm();
  while ((wide - narrow) * segment > kNarrowTolerance) {
    const double middle = 0.5 * (narrow + wide);
    const std::array<Pose, 2> rest = {interpolate(from, to, middle), to};
    const double clearance = certifier_.certify(rest).clearance_m;
    (clearance < problem_.limits.clearance - kRounding ? narrow : wide) = middle;
  }
  std::vector<Pose> part(waypoints.begin(), waypoints.begin() + static_cast<std::ptrdiff_t>(clear));
  part.push_back(interpolate(from, to, wide));

  const Certificate certificate = certifier_.certify(part);
  const auto at = static_cast<std::size_t>(certificate.segment);
  const Pose nearest = at + 1 < part.size()
                           ? interpolate(part[at], part[at + 1], certificate.fraction)
                           : part.back();
  return {length_of(part), nearest.p, name_of(certificate.obstacle)};
}

// A path found is a success, or leads out of a start that lacks the clearance.
void PathSearch::classify() {
  if (result_.clearance_m >= request_->limits.clearance - kRounding) {
    result_.status = PlanStatus::kSuccess;
    return;
  }
  result_.status = PlanStatus::kReduced;
  const NarrowPart& part = result_.reduced.emplace(narrow_part());
  result_.reason = fmt::format(
      "the start has {:.3f} m of the clearance of {:g} m: the first {:.2f} m of the path keep "
      "{:.3f} m, nearest {}, and the rest keeps {:g} m",
      start_clearance_, request_->limits.clearance, part.length_m, result_.clearance_m,
      part.obstacle, request_->limits.clearance);
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
  if (rolled) keep_better(optimise(*rolled), best);
}

void PathSearch::refine(int times, Attempt& best) {
  std::vector<Pose> finer;
  for (int time = 0; time < times; ++time) {
    if (best.good || !within_reach(best) || !split(best, finer)) return;
    keep_better(optimise(finer), best);
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
  if (!best.good && within_reach(best)) keep_better(optimise(best.path.waypoints), best);
  refine(kMaxRefinements, best);
  return best;
}

TrajoptAssessment PathSearch::assess(std::span<const Pose> path) {
  const Stopwatch stopwatch(clock_, statistics_->optimise_ms);
  return trajopt_.assess(problem_, path);
}

// Optimises a stretch as a problem of its own with given ends. If it fails, searches an alternative
// path between the ends: a hard place costs no more on a long path than on a short one.
std::vector<Pose> PathSearch::improve_stretch(std::span<const Pose> path, const Stretch& stretch) {
  const TrajoptProblem whole = problem_;
  const double start_clearance = start_clearance_;
  const double cutoff = cutoff_;
  cutoff_ = problem_.limits.clearance + options_.certify.tolerance;
  problem_.start = path[stretch.first];
  problem_.goal = path[stretch.last];
  if (stretch.first > 0) start_clearance_ = std::numeric_limits<double>::infinity();
  if (stretch.last + 1 < path.size()) problem_.goal_attitude_fixed = true;
  const auto part = path.subspan(stretch.first, stretch.last - stretch.first + 1);
  Attempt best = attempt_at_once({part.begin(), part.end()});
  if (!best.good && part.size() < path.size()) {
    best = attempt_around(std::move(best), &PathSearch::attempt_at_once);
  }
  problem_ = whole;
  start_clearance_ = start_clearance;
  cutoff_ = cutoff;
  return std::move(best.path.waypoints);
}

// `joints` are the waypoints of the result at the ends of stretches.
std::vector<Pose> PathSearch::improve_stretches(std::span<const Pose> path,
                                                std::span<const Stretch> stretches,
                                                std::vector<std::size_t>& joints) {
  std::vector<Pose> result;
  std::size_t next = 0;  // index in `path` of the next waypoint to copy
  for (const Stretch& stretch : stretches) {
    const auto before = path.subspan(next, stretch.first - std::min(stretch.first, next));
    result.insert(result.end(), before.begin(), before.end());
    if (stretch.first > 0) joints.push_back(result.size() - (stretch.first < next ? 1 : 0));
    const std::vector<Pose> better = improve_stretch(path, stretch);
    const std::size_t shared = stretch.first < next ? 1 : 0;
    result.insert(result.end(), better.begin() + static_cast<std::ptrdiff_t>(shared), better.end());
    next = stretch.last + 1;
    if (next < path.size()) joints.push_back(result.size() - 1);
  }
  const auto rest = path.subspan(next);
  result.insert(result.end(), rest.begin(), rest.end());
  return result;
}

// Stretches around the joints that would move if they were free.
std::vector<Stretch> PathSearch::stretches_at(std::span<const std::size_t> joints,
                                              std::span<const Pose> path) {
  const TrajoptProblem whole = problem_;
  problem_.goal_attitude_fixed = true;
  std::vector<bool> pulled(path.size());
  const std::vector<bool> violating(path.size());
  for (const std::size_t joint : joints) {
    const std::size_t first = joint - std::min(joint, kAround);
    const std::size_t last = std::min(joint + kAround, path.size() - 1);
    problem_.start = path[first];
    problem_.goal = path[last];
    const TrajoptAssessment around = assess(path.subspan(first, last - first + 1));
    pulled[joint] = around.pulled[joint - first] || around.violating[joint - first];
  }
  problem_ = whole;
  return find_stretches(pulled, violating);
}

// Stretches that were optimised separately meet in fixed waypoints: those that would move are
// optimised again with their surroundings.
void PathSearch::improve(std::vector<Stretch> stretches, std::vector<Pose>& path) {
  for (int round = 0; round < kMaxRounds && !stretches.empty(); ++round) {
    std::vector<std::size_t> joints;
    path = improve_stretches(path, stretches, joints);
    stretches = stretches_at(joints, path);
  }
}

// The waypoints where a path is short of the clearance, and `around` on either side. The path is
// certified piece by piece, because that is fast.
std::vector<bool> PathSearch::short_of_clearance(std::span<const Pose> path, std::size_t around) {
  std::vector<bool> result(path.size());
  const double cutoff = problem_.limits.clearance + options_.certify.tolerance;
  for (std::size_t first = 0; first + 1 < path.size(); first += kLongStretch) {
    const auto piece = path.subspan(first, std::min(kLongStretch + 1, path.size() - first));
    const Certificate certificate = certify(piece, cutoff);
    if (certificate.clearance_m >= problem_.limits.clearance - kRounding) continue;
    const std::size_t at = first + static_cast<std::size_t>(certificate.segment);
    const std::size_t end = std::min(at + around + 1, path.size());
    for (std::size_t i = at - std::min(at, around); i < end; ++i) result[i] = true;
  }
  return result;
}

// Solves nothing where the path meets its limits. A path that the optimiser reports as clear is
// certified once, at the end. If that fails because the true hull is nearer than its outline, the
// stretches around the failure are tried again with a certificate each, and longer every time.
PathSearch::Attempt PathSearch::attempt_by_stretches(const std::vector<Pose>& initial) {
  const TrajoptAssessment first = assess(initial);
  std::vector<Pose> path = first.path.waypoints;
  is_provisional_ = true;
  improve(find_stretches(first.pulled, first.violating), path);
  is_provisional_ = false;
  Attempt result;
  for (int round = 0;; ++round) {
    result.path.waypoints = path;
    result.certificate = certify(path, cutoff_);
    result.good = keeps_clearance(result);
    if (result.good) return result;
    if (round == kMaxRounds) break;
    const std::size_t around = kWider * static_cast<std::size_t>(round);
    improve(find_stretches(std::vector<bool>(path.size()), short_of_clearance(path, around)), path);
  }
  result.path = assess(path).path;
  if (within_reach(result)) keep_better(attempt_at_once(path), result);
  return result;
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
    keep_better(Attempt(last), best);
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
    return fmt::format("blocked: there is no way to the goal, and {} is in the straight one",
                       name_of(nearest_));
  }
  const std::string best = result_.clearance_m > 0.0
                               ? fmt::format("the best found keeps {:.2f} m, nearest {}",
                                             result_.clearance_m, name_of(nearest_))
                               : fmt::format("all that were found touch {}", name_of(nearest_));
  if (bound < request_->limits.clearance) {
    return fmt::format("too tight for {:.2f} m (at most {:.2f} m is possible); {}",
                       request_->limits.clearance, std::max(bound, 0.0), best);
  }
  return fmt::format("no path found that keeps {:.2f} m; {}", request_->limits.clearance, best);
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
      search_warm_starts() || search_widest();
  if (found) {
    classify();
  } else if (start_clearance_ < request.limits.clearance) {
    result_.reason += fmt::format("; the start itself has {:.2f} m", start_clearance_);
  }
  result_.length_m = length_of(result_.waypoints);
  return std::move(result_);
}

}  // namespace dive::planning
