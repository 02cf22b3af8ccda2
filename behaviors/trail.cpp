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

}  // namespace

std::vector<Pose> level_poses(const std::vector<Eigen::Vector3d>& points) {
  DIVE_DEMAND(points.size() >= 2);
  std::vector<Pose> poses(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d way = i + 1 < points.size() ? Eigen::Vector3d(points[i + 1] - points[i])
                                                      : Eigen::Vector3d(points[i] - points[i - 1]);
    poses[i] = Pose{points[i], from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()))};
  }
  return poses;
}

Trail::Trail(double spacing, std::size_t capacity) : spacing_(spacing), capacity_(capacity) {
  DIVE_DEMAND(spacing > 0.0 && capacity >= 4);
  crumbs_.reserve(capacity);  // no allocation during a dive
}

void Trail::add(const Eigen::Vector3d& p_W, bool open_above) {
  if (!crumbs_.empty()) {
    const bool near = (p_W - crumbs_.back().p_W).norm() < spacing_;
    // The last open point before an overhead gets a breadcrumb of its own, however near the last.
    if (near && open_above == crumbs_.back().open_above) return;
  }
  const double step = crumbs_.empty() ? 0.0 : (p_W - crumbs_.back().p_W).norm();
  penetration_m_ = open_above ? 0.0 : penetration_m_ + step;
  if (crumbs_.size() == capacity_) thin_out();
  crumbs_.push_back({p_W, open_above});
  ++dropped_;
}

void Trail::thin_out() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < crumbs_.size(); i += 2) crumbs_[kept++] = crumbs_[i];
  crumbs_.resize(kept);
  spacing_ *= 2.0;
}

// Where an overhead begins two breadcrumbs lie in the same place.
bool Trail::was_open_at(const Eigen::Vector3d& p_W) const {
  DIVE_DEMAND(!crumbs_.empty());
  double to_open = std::numeric_limits<double>::infinity();
  double to_covered = to_open;
  for (const Crumb& crumb : crumbs_) {
    double& to = crumb.open_above ? to_open : to_covered;
    to = std::min(to, (crumb.p_W - p_W).norm());
  }
  return to_open <= to_covered + kHardly;
}

// Dijkstra's algorithm over the breadcrumbs, from p_W to the first one that satisfies the
// condition.
Trail::Found Trail::find(const Eigen::Vector3d& p_W, double link_m, double most_m,
                         const std::function<bool(const Crumb&)>& is_there) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const std::size_t count = crumbs_.size();
  const std::size_t here = count;  // p_W comes after the newest breadcrumb
  const auto place = [&](std::size_t i) { return i == here ? p_W : crumbs_[i].p_W; };
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
    if (at != here && is_there(crumbs_[at])) return {traced(before, at, length, p_W), at};
    const Eigen::Vector3d from = place(at);
    for (std::size_t i = 0; i < count; ++i) {
      const double step = (crumbs_[i].p_W - from).norm();
      const bool is_next = i + 1 == at || i == at + 1;
      if ((!is_next && step > link_m) || length + step >= distance[i]) continue;
      distance[i] = length + step;
      before[i] = at;
      open.emplace(distance[i], i);
    }
  }
  Found none;
  none.way.points = {p_W};
  none.end = count;
  return none;
}

Trail::Way Trail::way_out(const Eigen::Vector3d& p_W, double link_m, double beyond_m) const {
  Found found = find(p_W, link_m, std::numeric_limits<double>::infinity(),
                     [](const Crumb& crumb) { return crumb.open_above; });
  if (!found.way.arrives) return std::move(found.way);
  return further(std::move(found.way), found.end, beyond_m);
}

Trail::Way Trail::way_to(const Eigen::Vector3d& p_W, double link_m, double most_m,
                         const std::function<bool(const Crumb&)>& is_there) const {
  return find(p_W, link_m, most_m, is_there).way;
}

// The path from the open breadcrumb `end` on to older ones.
Trail::Way Trail::further(Way way, std::size_t end, double beyond_m) const {
  double gone = 0.0;
  for (std::size_t i = end; i-- > 0 && crumbs_[i].open_above && gone < beyond_m;) {
    const double step = (crumbs_[i].p_W - way.points.back()).norm();
    if (step <= kSamePoint) continue;
    way.points.push_back(crumbs_[i].p_W);
    way.length_m += step;
    gone += step;
  }
  return way;
}

Trail::Way Trail::traced(const std::vector<std::size_t>& before, std::size_t end, double length,
                         const Eigen::Vector3d& p_W) const {
  Way way;
  way.arrives = true;
  way.length_m = length;
  for (std::size_t at = end; at != crumbs_.size(); at = before[at]) {
    if (way.points.empty() || (crumbs_[at].p_W - way.points.back()).norm() > kSamePoint) {
      way.points.push_back(crumbs_[at].p_W);
    }
  }
  if ((p_W - way.points.back()).norm() > kSamePoint || way.points.size() == 1) {
    way.points.push_back(p_W);
  }
  std::ranges::reverse(way.points);
  return way;
}

}  // namespace dive::behaviors
