#include "behaviors/trail.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "common/assert.h"

namespace dive::behaviors {
namespace {

constexpr double kSamePoint = 1e-6;  // m
constexpr double kHardly = 0.25;     // m: half the distance between breadcrumbs
constexpr double kNearGoal = 1.0;    // m from the trail to a goal that it leads to
// The longest trail to a goal that is worth trying, by its distance: it bounds the search.
constexpr double kLongestShare = 4.0;
constexpr double kLongestExtra = 5.0;  // m

}  // namespace

std::vector<Pose> level_poses(const std::vector<Eigen::Vector3d>& points) {
  DIVE_DEMAND(points.size() >= 2);
  std::vector<Pose> poses(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d direction = i + 1 < points.size()
                                          ? Eigen::Vector3d(points[i + 1] - points[i])
                                          : Eigen::Vector3d(points[i] - points[i - 1]);
    poses[i] = Pose{points[i], from_rpy(0.0, 0.0, std::atan2(direction.y(), direction.x()))};
  }
  return poses;
}

std::vector<Pose> trail_to(const Trail& trail, const Eigen::Vector3d& p_W,
                           const Eigen::Vector3d& goal_W, double link_m) {
  const auto is_there = [&](const Trail::Breadcrumb& breadcrumb) {
    return (breadcrumb.p_W - goal_W).norm() < kNearGoal;
  };
  // Most goals are new, and the search along the trail is quadratic in its length.
  if (std::ranges::none_of(trail.breadcrumbs(), is_there)) return {};
  const double longest_m = kLongestShare * (goal_W - p_W).norm() + kLongestExtra;
  Trail::Path path = trail.path_to(p_W, link_m, longest_m, is_there);
  if (!path.arrives) return {};
  path.points.push_back(goal_W);
  return level_poses(path.points);
}

Trail::Trail(double spacing, std::size_t capacity) : spacing_(spacing), capacity_(capacity) {
  DIVE_DEMAND(spacing > 0.0 && capacity >= 4);
  breadcrumbs_.reserve(capacity);  // no allocation during a dive
}

void Trail::add(const Eigen::Vector3d& p_W, bool open_above, Utime now) {
  if (!breadcrumbs_.empty()) {
    const bool near = (p_W - breadcrumbs_.back().p_W).norm() < spacing_;
    // The last open point before an overhead gets a breadcrumb of its own, however near the last.
    if (near && open_above == breadcrumbs_.back().open_above) return;
  }
  const double step = breadcrumbs_.empty() ? 0.0 : (p_W - breadcrumbs_.back().p_W).norm();
  penetration_m_ = open_above ? 0.0 : penetration_m_ + step;
  if (breadcrumbs_.size() == capacity_) thin_out();
  breadcrumbs_.push_back({p_W, open_above, now});
  ++dropped_;
}

void Trail::move(const MapCorrection& correction) {
  for (Breadcrumb& breadcrumb : breadcrumbs_) {
    breadcrumb.p_W = correction.at(breadcrumb.utime) * breadcrumb.p_W;
  }
  ++moves_;
  measure_penetration();
}

void Trail::restore(std::span<const Breadcrumb> breadcrumbs, double spacing) {
  DIVE_DEMAND(breadcrumbs.size() <= capacity_ && spacing > 0.0);
  breadcrumbs_.assign(breadcrumbs.begin(), breadcrumbs.end());
  spacing_ = spacing;
  dropped_ = breadcrumbs_.size();
  measure_penetration();
}

void Trail::measure_penetration() {
  penetration_m_ = 0.0;
  for (std::size_t i = 1; i < breadcrumbs_.size(); ++i) {
    const double step = (breadcrumbs_[i].p_W - breadcrumbs_[i - 1].p_W).norm();
    penetration_m_ = breadcrumbs_[i].open_above ? 0.0 : penetration_m_ + step;
  }
}

void Trail::thin_out() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < breadcrumbs_.size(); i += 2) breadcrumbs_[kept++] = breadcrumbs_[i];
  breadcrumbs_.resize(kept);
  spacing_ *= 2.0;
}

// Where an overhead begins two breadcrumbs lie in the same place.
bool Trail::was_open_at(const Eigen::Vector3d& p_W) const {
  DIVE_DEMAND(!breadcrumbs_.empty());
  double to_open = std::numeric_limits<double>::infinity();
  double to_covered = to_open;
  for (const Breadcrumb& breadcrumb : breadcrumbs_) {
    double& to = breadcrumb.open_above ? to_open : to_covered;
    to = std::min(to, (breadcrumb.p_W - p_W).norm());
  }
  return to_open <= to_covered + kHardly;
}

// Dijkstra's algorithm over the breadcrumbs, from p_W to the first one that satisfies the
// condition.
Trail::Found Trail::find(const Eigen::Vector3d& p_W, double link_m, double most_m,
                         const std::function<bool(const Breadcrumb&)>& is_there) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const std::size_t count = breadcrumbs_.size();
  const std::size_t here = count;  // p_W comes after the newest breadcrumb
  const auto place = [&](std::size_t i) { return i == here ? p_W : breadcrumbs_[i].p_W; };
  std::vector<double> distance(count + 1, kFar);
  std::vector<std::size_t> before(count + 1, here);
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  distance[here] = 0.0;
  open.emplace(0.0, here);
  while (!open.empty()) {
    const auto [length, at] = open.top();
    open.pop();
    if (length > distance[at]) continue;
    if (length > most_m) break;
    if (at != here && is_there(breadcrumbs_[at])) return {traced(before, at, length, p_W), at};
    const Eigen::Vector3d from = place(at);
    for (std::size_t i = 0; i < count; ++i) {
      const double step = (breadcrumbs_[i].p_W - from).norm();
      const bool is_next = i + 1 == at || i == at + 1;
      if ((!is_next && step > link_m) || length + step >= distance[i]) continue;
      distance[i] = length + step;
      before[i] = at;
      open.emplace(distance[i], i);
    }
  }
  Found none;
  none.path.points = {p_W};
  none.end = count;
  return none;
}

Trail::Path Trail::exit_path(const Eigen::Vector3d& p_W, double link_m, double beyond_m) const {
  Found found = find(p_W, link_m, std::numeric_limits<double>::infinity(),
                     [](const Breadcrumb& breadcrumb) { return breadcrumb.open_above; });
  if (!found.path.arrives) return std::move(found.path);
  return further(std::move(found.path), found.end, beyond_m);
}

Trail::Path Trail::path_to(const Eigen::Vector3d& p_W, double link_m, double most_m,
                           const std::function<bool(const Breadcrumb&)>& is_there) const {
  return find(p_W, link_m, most_m, is_there).path;
}

// The path from the open breadcrumb `end` on to older ones.
Trail::Path Trail::further(Path path, std::size_t end, double beyond_m) const {
  double gone = 0.0;
  for (std::size_t i = end; i > 0; --i) {
    const Breadcrumb& breadcrumb = breadcrumbs_[i - 1];
    if (!breadcrumb.open_above || gone >= beyond_m) break;
    const double step = (breadcrumb.p_W - path.points.back()).norm();
    if (step <= kSamePoint) continue;
    path.points.push_back(breadcrumb.p_W);
    path.length_m += step;
    gone += step;
  }
  return path;
}

Trail::Path Trail::traced(const std::vector<std::size_t>& before, std::size_t end, double length,
                          const Eigen::Vector3d& p_W) const {
  Path path;
  path.arrives = true;
  path.length_m = length;
  for (std::size_t at = end; at != breadcrumbs_.size(); at = before[at]) {
    if (path.points.empty() || (breadcrumbs_[at].p_W - path.points.back()).norm() > kSamePoint) {
      path.points.push_back(breadcrumbs_[at].p_W);
    }
  }
  if ((p_W - path.points.back()).norm() > kSamePoint || path.points.size() == 1) {
    path.points.push_back(p_W);
  }
  std::ranges::reverse(path.points);
  return path;
}

}  // namespace dive::behaviors
