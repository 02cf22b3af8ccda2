#include "estimation/visual_inertial/filter/zero_velocity_detector.h"

#include "estimation/visual_inertial/filter/image_motion.h"

namespace dive::estimation {
namespace {

constexpr double kStill_s = 1.0;

}  // namespace

std::optional<double> ZeroVelocityDetector::rest_s(const FeatureFrame& frame,
                                                   const ImuBuffer& imu) {
  const auto motion = motion_between(reference_, frame, options_.cameras.front());
  if (!motion || *motion > still_motion(options_)) {
    reference_ = frame;
    return std::nullopt;
  }
  const double seconds = to_seconds(frame.utime - reference_.utime);
  if (seconds < kStill_s) return std::nullopt;
  const auto scatter = imu.scatter(kStill_s);
  const bool is_quiet = scatter && scatter->gyro_sigma < options_.zero_velocity_gyro_sigma &&
                        scatter->accel_sigma < options_.zero_velocity_accel_sigma;
  return is_quiet ? std::optional(seconds) : std::nullopt;
}

}  // namespace dive::estimation
