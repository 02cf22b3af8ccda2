#pragma once
// What the visual-inertial estimator begins from, and begins again from.
//
// It begins again when the filter has diverged, when no feature was used for long although there
// are some, after a long gap in the IMU samples, and after long darkness.

#include <string>
#include <variant>

#include "common/clock.h"
#include "estimation/visual_inertial/filter/filter_start.h"

namespace dive::estimation {

/// From the published estimate, at first and each time again: in a dive.
struct PublishedStart {};

/// The others need no published estimate, as on a recording: the filter begins as given, and again
/// from images, with the pose that is known best by then:
///   - after a gap or darkness the filter's own prediction; in darkness it is used until images
///     return;
///   - after a failure, a pose of five to ten seconds before the last healthy estimate, as for
///     the biases, because the cause acts before it is noticed; the given start where there is
///     none.
/// The heading follows the gyro since then. Position and heading are given the sigma that they had,
/// grown: the position by the greater of the vehicle's speed then and 0.4 m/s, the heading by the
/// gyro's bias, and by the rate of a gap where there are no samples.
using VisionStart = std::variant<PublishedStart, ImageStart, KnownStart>;

/// The filter was begun again.
struct VisionRestart {
  Utime utime = 0;          ///< Time of the newest IMU sample.
  bool has_failed = false;  ///< The filter had diverged, or used no feature.
  std::string reason;       ///< A clause, such as "no IMU samples for 2.1 s".
};

}  // namespace dive::estimation
