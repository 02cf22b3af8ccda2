#pragma once
// Detects whether the vehicle is at rest: neither the IMU nor the images show motion. The IMU alone
// cannot detect it: a gliding vehicle is as quiet.

#include "estimation/visual_inertial/filter/imu_buffer.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"

namespace dive::estimation {

class ZeroVelocityDetector {
 public:
  explicit ZeroVelocityDetector(const VisualInertialOptions& options) : options_(options) {}

  void reset() { reference_ = {}; }
  /// Seconds for which nothing has moved up to `frame`; empty if less than one.
  [[nodiscard]] std::optional<double> rest_s(const FeatureFrame& frame, const ImuBuffer& imu);

 private:
  VisualInertialOptions options_;
  FeatureFrame reference_;  ///< The frame since which the image has not moved.
};

}  // namespace dive::estimation
