#pragma once
// Whether the vehicle stands still: neither the IMU nor the picture says otherwise. The IMU alone
// cannot know: a vehicle that glides is as quiet.

#include "estimation/visual_inertial/feature_frame.h"
#include "estimation/visual_inertial/imu_buffer.h"

namespace dive::estimation {

class StillDetector {
 public:
  explicit StillDetector(const VisualInertialOptions& options) : options_(options) {}

  void reset() { reference_ = {}; }
  /// Whether nothing has moved for the half second up to `frame`.
  [[nodiscard]] bool is_still(const FeatureFrame& frame, const ImuBuffer& imu);

 private:
  VisualInertialOptions options_;
  FeatureFrame reference_;  ///< The picture has not moved since.
};

}  // namespace dive::estimation
