#include "mission/executive/overhead_monitor.h"

#include <algorithm>

namespace dive::mission {
namespace {

constexpr double kSoundingPeriod = 0.5;  // s: finding the ground takes some time

}  // namespace

OverheadMonitor::OverheadMonitor(const Mission& mission, MapView& map)
    : mission_(mission), map_(map) {
  if (mission.unknown) declared_.emplace();
}

void OverheadMonitor::restore(std::span<const behaviors::Trail::Breadcrumb> trail, double spacing) {
  trail_.restore(trail, spacing);
  if (declared_) declared_->restore(trail, spacing);
}

void OverheadMonitor::move(const MapCorrection& correction) {
  trail_.move(correction);
  if (declared_) declared_->move(correction);
}

void OverheadMonitor::update(Utime now, const estimation::StateEstimate& estimate,
                             std::optional<bool> declared_overhead, double battery_fraction) {
  const Eigen::Vector3d& p_W = estimate.X_WB.p;
  has_overhead_ = is_declared_overhead(p_W, declared_overhead, now) || map_.overhead(p_W, 0.0);
  const double margin = kAscentDrift + estimation::horizontal_sigma(estimate);
  open_above_ = !has_overhead_ && !map_.overhead(p_W, margin);
  trail_.add(p_W, open_above_, now);
  if (open_above_) usable_ = Usable{now, battery_fraction};
  if (now < next_sounding_) return;
  next_sounding_ = now + from_seconds(kSoundingPeriod);
  const std::optional<double> ground = map_.ground_below(p_W);
  altitude_m_ = ground ? std::optional(p_W.z() - *ground) : std::nullopt;
}

// A camera that points down cannot observe an overhead: in an unknown environment the mission's
// declaration counts. An atomic state with goals declares the overhead above its path; for all
// others the trail has recorded it.
bool OverheadMonitor::is_declared_overhead(const Eigen::Vector3d& p_W,
                                           std::optional<bool> declared_overhead, Utime now) {
  if (!declared_) return false;
  if (!declared_overhead && declared_->size() > 0) return !declared_->was_open_at(p_W);
  const bool is_roofed = declared_overhead.value_or(false);
  declared_->add(p_W, !is_roofed, now);
  return is_roofed;
}

double OverheadMonitor::budget_used(Utime now, Utime started_at, double battery_fraction) const {
  if (open_above_ || !usable_) return 0.0;
  const double time_left =
      mission_.limits.mission_timeout.value - to_seconds(usable_->at - started_at);
  const double charge_left = usable_->battery_fraction - mission_.limits.battery_reserve.value;
  const double charge = usable_->battery_fraction - battery_fraction;
  const double time_share = time_left > 0.0 ? to_seconds(now - usable_->at) / time_left : 1.0;
  const double charge_share = charge_left > 0.0 ? std::max(charge, 0.0) / charge_left : 1.0;
  return std::max(time_share, charge_share);
}

}  // namespace dive::mission
