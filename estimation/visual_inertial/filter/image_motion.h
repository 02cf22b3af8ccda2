#pragma once
// Motion between two images, to tell rest from motion. Internal.

#include <optional>

#include "estimation/visual_inertial/filter/filter_options.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"

namespace dive::estimation {

/// Median distance of the features common to both, pixels; empty if they are fewer than ten.
[[nodiscard]] std::optional<double> motion_between(const FeatureFrame& a, const FeatureFrame& b,
                                                   const CameraModel& left);

/// The largest that may be noise alone, pixels.
[[nodiscard]] double still_motion(const VisualInertialOptions& options);

/// What so small a motion in `seconds` may hide.
struct HiddenMotion {
  double speed = 0.0;  ///< m/s, before a scene six metres away.
  double rate = 0.0;   ///< rad/s
};
[[nodiscard]] HiddenMotion hidden_motion(const VisualInertialOptions& options, double seconds);

}  // namespace dive::estimation
