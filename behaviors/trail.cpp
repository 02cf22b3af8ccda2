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
constexpr double kHardly = 0.25;     // m: half of what crumbs are apart

}  // namespace

Trail::Trail(double spacing, std::size_t capacity) : spacing_(spacing), capacity_(capacity) {
  DIVE_DEMAND(spacing > 0.0 && capacity >= 4);
  crumbs_.reserve(capacity);  // nothing is allocated while diving
}

void Trail::add(const Eigen::Vector3d& p_W, bool open_above) {
  if (!crumbs_.empty()) {
    const bool near = (p_W - crumbs_.back().p_W).norm() < spacing_;
    // The last open point before a roof is worth a crumb of its own, however near.
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

// Where a roof begins two crumbs lie in the same place.
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

// Dijkstra over the crumbs, from p_W, until the first one with open water is settled.
Trail::WayOut Trail::way_out(const Eigen::Vector3d& p_W, double link_m, double beyond_m) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const std::size_t count = crumbs_.size();
  const std::size_t here = count;  // p_W comes after the newest crumb
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
    if (at != here && crumbs_[at].open_above) {
      return further(traced(before, at, length, p_W), at, beyond_m);
    }
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
  WayOut none;
  none.points = {p_W};
  return none;
}

// The way on from the open crumb `end`, to older ones.
Trail::WayOut Trail::further(WayOut way, std::size_t end, double beyond_m) const {
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

Trail::WayOut Trail::traced(const std::vector<std::size_t>& before, std::size_t end, double length,
                            const Eigen::Vector3d& p_W) const {
  WayOut way;
  way.reaches_open_water = true;
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
