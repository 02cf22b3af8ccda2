// Long paths, optimised stretch by stretch (stretches.h).

#include <algorithm>
#include <limits>
#include <utility>

#include "planning/path_search.h"

namespace dive::planning {
namespace {

constexpr int kMaxRounds = 3;       // rounds of optimising the joints between stretches
constexpr std::size_t kAround = 2;  // waypoints on either side from which a joint is assessed
constexpr std::size_t kWider = 8;   // waypoints by which a failed stretch grows

}  // namespace

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
  if (within_reach(result)) result.keep_better(attempt_at_once(path));
  return result;
}

}  // namespace dive::planning
