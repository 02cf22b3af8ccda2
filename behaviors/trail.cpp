#include "behaviors/trail.h"

#include "common/assert.h"

namespace dive::behaviors {

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
}

void Trail::thin_out() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < crumbs_.size(); i += 2) crumbs_[kept++] = crumbs_[i];
  crumbs_.resize(kept);
  spacing_ *= 2.0;
}

Trail::WayOut Trail::way_out(const Eigen::Vector3d& p_W) const {
  WayOut way;
  way.points.push_back(p_W);
  for (auto crumb = crumbs_.rbegin(); crumb != crumbs_.rend(); ++crumb) {
    const double step = (crumb->p_W - way.points.back()).norm();
    if (step > 1e-6) {
      way.points.push_back(crumb->p_W);
      way.length_m += step;
    }
    if (crumb->open_above) {
      way.reaches_open_water = true;
      break;
    }
  }
  return way;
}

}  // namespace dive::behaviors
