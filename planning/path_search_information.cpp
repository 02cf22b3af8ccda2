// Paths that keep informative surfaces in view: an alternative around what is poorest in
// information replaces the path where it is worth its length.

#include <algorithm>
#include <cmath>

#include "planning/map_matching/expected_view.h"
#include "planning/path_search.h"

namespace dive::planning {
namespace {

constexpr double kPiece = 1.0;      // m, longest piece of a path that one view stands for
constexpr double kPoorSigma = 0.2;  // m: a worse fix hardly corrects dead reckoning
constexpr double kEnough = 1.0;     // m of path without information that change nothing
constexpr double kMaxBall = 4.0;    // m, radius of a virtual obstacle
constexpr int kAlternatives = 4;    // warm starts tried
constexpr int kFirstNumber = 1000;  // their seeds differ from those of other warm starts
constexpr double kSameCost = 0.1;   // m: two paths alike

// The part of a path where scans do not tell the position.
struct PoorPart {
  double length_m = 0.0;
  double longest_m = 0.0;                              // of its stretches
  Eigen::Vector3d middle_W = Eigen::Vector3d::Zero();  // of the longest one
};

PoorPart poor_part(const ExpectedView& view, std::span<const Pose> path) {
  PoorPart poor;
  double stretch_m = 0.0;
  Eigen::Vector3d begin_W = path.front().p;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double length = (path[i].p - path[i - 1].p).norm();
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / kPiece)));
    for (int k = 0; k < pieces; ++k) {
      const Pose end = interpolate(path[i - 1], path[i], (k + 1.0) / pieces);
      if (view.worst_sigma(interpolate(path[i - 1], path[i], (k + 0.5) / pieces)) <= kPoorSigma) {
        stretch_m = 0.0;
        begin_W = end.p;
        continue;
      }
      poor.length_m += length / pieces;
      stretch_m += length / pieces;
      if (stretch_m <= poor.longest_m) continue;
      poor.longest_m = stretch_m;
      poor.middle_W = 0.5 * (begin_W + end.p);
    }
  }
  return poor;
}

}  // namespace

void PathSearch::prefer_information() {
  const ExpectedView& view = *options_.preferred_view;
  const auto cost_of = [&](const PoorPart& poor, std::span<const Pose> path) {
    return path_length(path) + options_.information_weight * poor.length_m;
  };
  PoorPart poor = poor_part(view, result_.waypoints);
  double least = cost_of(poor, result_.waypoints);
  std::vector<VirtualObstacle> avoid;
  for (int number = 0; number < kAlternatives && poor.length_m > kEnough; ++number) {
    avoid.push_back(
        {poor.middle_W, std::clamp(0.5 * poor.longest_m, request_->limits.clearance, kMaxBall)});
    const std::size_t avoided = avoid.size();
    const std::optional<std::vector<Pose>> next = warm_start(avoid, kFirstNumber + number);
    if (!next || avoid.size() < avoided) return;  // there is no way around
    ++result_.warm_starts;
    Attempt other = attempt(*next);
    if (!other.good) continue;
    poor = poor_part(view, other.path.waypoints);
    const double cost = cost_of(poor, other.path.waypoints);
    if (cost > least - kSameCost) continue;
    least = cost;
    last_ = std::move(other);
    take_last();
  }
}

}  // namespace dive::planning
