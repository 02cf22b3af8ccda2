#include "estimation/visual_inertial/filter/zero_velocity_detector.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace dive::estimation {
namespace {

constexpr double kStill_s = 0.5;
constexpr std::size_t kMinFeatures = 10;
constexpr double kMedianOfNoise = 1.177;  // of a distance, per sigma of each axis (Rayleigh)

// Median distance of the features common to both, pixels; empty if they are few.
std::optional<double> motion_between(const FeatureFrame& a, const FeatureFrame& b,
                                     const CameraModel& left) {
  std::map<std::int64_t, Eigen::Vector2d> places;
  for (const FeatureObservation& feature : a.features) {
    if (feature.left.allFinite()) places[feature.id] = feature.left;
  }
  std::vector<double> distances;
  for (const FeatureObservation& feature : b.features) {
    const auto found = places.find(feature.id);
    if (found == places.end() || !feature.left.allFinite()) continue;
    distances.push_back((left.jacobian(feature.left) * (feature.left - found->second)).norm());
  }
  if (distances.size() < kMinFeatures) return std::nullopt;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

}  // namespace

bool ZeroVelocityDetector::is_at_rest(const FeatureFrame& frame, const ImuBuffer& imu) {
  const auto motion = motion_between(reference_, frame, options_.cameras.front());
  const double noise = kMedianOfNoise * std::sqrt(2.0) * options_.pixel_sigma;  // two frames
  const double most = std::hypot(options_.zero_velocity_pixels, noise);
  if (!motion || *motion > most) {
    reference_ = frame;
    return false;
  }
  if (to_seconds(frame.utime - reference_.utime) < kStill_s) return false;
  const auto scatter = imu.scatter(kStill_s);
  return scatter && scatter->gyro_sigma < options_.zero_velocity_gyro_sigma &&
         scatter->accel_sigma < options_.zero_velocity_accel_sigma;
}

}  // namespace dive::estimation
