#include "estimation/visual_inertial/filter/zero_velocity_detector.h"

#include "estimation/visual_inertial/filter/image_motion.h"

namespace dive::estimation {
namespace {

constexpr double kStill_s = 1.0;

}  // namespace

bool ZeroVelocityDetector::is_at_rest(const FeatureFrame& frame, const ImuBuffer& imu) {
  const auto motion = motion_between(reference_, frame, options_.cameras.front());
  if (!motion || *motion > still_motion(options_)) {
    reference_ = frame;
    return false;
  }
  if (to_seconds(frame.utime - reference_.utime) < kStill_s) return false;
  const auto scatter = imu.scatter(kStill_s);
  return scatter && scatter->gyro_sigma < options_.zero_velocity_gyro_sigma &&
         scatter->accel_sigma < options_.zero_velocity_accel_sigma;
}

}  // namespace dive::estimation
