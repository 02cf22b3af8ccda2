#include "mission/executive/sensing.h"

#include "mission/executive/map_updates.h"

namespace dive::mission {
namespace {

using behaviors::FailsafeKind;

constexpr Utime kMaxDepthAge = 500'000;  // us; for older samples the estimated depth is used
// us; for older samples no turning effort is made by attitude
constexpr Utime kMaxImuAge = 100'000;

template <class ScanMessage>
bool accept_scan(Utime now, const ScanMessage& message, std::optional<Utime>& last) {
  const bool is_newer = !last || message.scan_utime > *last;
  if (!is_newer || message.scan_utime > now + kMaxScanLead || !is_well_formed(message))
    return false;
  last = message.scan_utime;
  return true;
}

}  // namespace

bool Sensing::accept(Utime now, const planning::FreeAhead& free_ahead) {
  return accept_scan(now, free_ahead, last_free_ahead_);
}

bool Sensing::accept(Utime now, const planning::ObstacleAhead& obstacle) {
  return accept_scan(now, obstacle, last_obstacle_);
}

bool Sensing::accept(Utime now, const planning::PoseCorrection& correction) {
  return accept_scan(now, correction, last_correction_);
}

bool Sensing::accept(Utime now, const MapFix& fix) { return accept_scan(now, fix, last_fix_); }

bool Sensing::accept(Utime now, const MapCorrection& correction) {
  return is_well_formed(correction) && correction.nodes.back().utime <= now;
}

void Sensing::update(const StepInputs& inputs, behaviors::Monitors& monitors,
                     Localization& localization) {
  const bool imu_is_lost = monitors.is_true(FailsafeKind::kImuLost);
  const bool depth_is_lost = monitors.is_true(FailsafeKind::kDepthLost);
  if (inputs.imu && monitors.accept(inputs.now, *inputs.imu)) {
    imu_ = *inputs.imu;
    imu_received_ = inputs.now;
    if (!imu_is_lost) localization.add(*inputs.imu);
  }
  if (inputs.depth && monitors.accept(inputs.now, *inputs.depth)) {
    depth_ = *inputs.depth;
    depth_received_ = inputs.now;
    if (!depth_is_lost) localization.add(*inputs.depth);
  }
  if (inputs.health) static_cast<void>(monitors.accept(inputs.now, *inputs.health));
  status_.imu_is_fresh = !imu_is_lost && inputs.now - imu_received_ <= kMaxImuAge;
  status_.depth_is_fresh = depth_ && !depth_is_lost && inputs.now - depth_received_ <= kMaxDepthAge;
  status_.depth_m = depth_ ? depth_->depth_m : 0.0;
}

}  // namespace dive::mission
