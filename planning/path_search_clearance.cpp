// What makes a path good enough: the certified clearance, or a narrow part at the start only.

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "common/assert.h"
#include "planning/path_search.h"

namespace dive::planning {
namespace {

constexpr double kNarrowTolerance = 0.01;  // m, on the length of a narrow part

}  // namespace

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
      path_length(waypoints.first(std::min(clear + 1, waypoints.size()))) > kMaxReducedLength) {
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
  return {path_length(part), nearest.p, name_of(certificate.obstacle)};
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
      "the start has a clearance of {:.3f} m, less than {:g} m: the first {:.2f} m of the path "
      "keep "
      "{:.3f} m, nearest to {}, and the rest keeps {:g} m",
      start_clearance_, request_->limits.clearance, part.length_m, result_.clearance_m,
      part.obstacle, request_->limits.clearance);
}

}  // namespace dive::planning
