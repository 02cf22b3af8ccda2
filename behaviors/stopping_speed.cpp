#include "behaviors/stopping_speed.h"

#include <algorithm>
#include <limits>

namespace dive::behaviors {
namespace {

constexpr double kBraking = 3.0;

}  // namespace

void StoppingSpeed::advance(Utime now, const Eigen::Vector3d& p_W) {
  if (last_W_) swum_m_ += (p_W - *last_W_).norm();
  last_W_ = p_W;
  distances_.push(now, swum_m_);
}

void StoppingSpeed::add_scan(Utime scan_utime, double free_ahead_m) {
  double swum_m = 0.0;  // before the oldest tick
  if (!distances_.empty()) {
    const auto ticks = distances_.at(std::min(scan_utime, distances_.newest_utime()));
    if (ticks) swum_m = *ticks->before;
  }
  scan_ = Scan{scan_utime, free_ahead_m, swum_m};
}

double StoppingSpeed::max_command(Utime now, double speed) const {
  if (!scan_ || to_seconds(now - scan_->utime) > options_.stale_s) return 0.0;
  if (!options_.requires_observed_space) return std::numeric_limits<double>::infinity();
  const double left = scan_->free_ahead_m - (swum_m_ - scan_->swum_m) - options_.margin_m;
  const double most = std::max(left / (options_.reaction_s + options_.time_constant_s), 0.0);
  return std::clamp(most - kBraking * (speed - most), 0.0, most);
}

}  // namespace dive::behaviors
