#pragma once
// What a fit of the motion model needs of one dive: what a vehicle without ground truth records.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/map_fix.h"
#include "common/measurements.h"

namespace dive::estimation {

/// One control tick.
struct MotionTick {
  Utime now = 0;
  std::optional<ImuSample> imu;      ///< Attitude and turn rate that arrived in this tick.
  std::optional<DepthSample> depth;  ///< Depth that arrived in this tick.
  /// Efforts of the flippers in surge and heave from this tick on, each in [-1, 1].
  Eigen::Vector2d efforts = Eigen::Vector2d::Zero();
};

struct MotionRecord {
  std::string name;               ///< For messages.
  std::vector<MotionTick> ticks;  ///< In order of time.
  /// Position fixes in order of their time (MapFix::scan_utime): from scans of a known map, from
  /// tags, or from cameras; as log-likelihoods, so that a fix without information in one
  /// direction counts in the other.
  std::vector<MapFix> fixes;
};

/// The position that a fix shows.
struct ShownPosition {
  Eigen::Vector2d position_W = Eigen::Vector2d::Zero();  ///< m
  double heading_correction = 0.0;                       ///< From the compass to the map, rad.
  double sigma_m = 0.0;                                  ///< Along its least certain direction.
};

/// Nothing if the fix leaves a direction open by more than a metre.
[[nodiscard]] std::optional<ShownPosition> shown_position(const MapFix& fix);

}  // namespace dive::estimation
