#include "estimation/visual_inertial/filter/image_motion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace dive::estimation {
namespace {

constexpr std::size_t kMinFeatures = 10;
constexpr double kFarScene_m = 6.0;       // farther things are rarely visible under water
constexpr double kMedianOfNoise = 1.177;  // of a distance, per sigma of each axis (Rayleigh)

}  // namespace

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

double still_motion(const VisualInertialOptions& options) {
  const double noise = kMedianOfNoise * std::sqrt(2.0) * options.pixel_sigma;  // two frames
  return std::hypot(options.zero_velocity_pixels, noise);
}

HiddenMotion hidden_motion(const VisualInertialOptions& options, double seconds) {
  const double rate = still_motion(options) / (options.cameras.front().focal() * seconds);
  return {kFarScene_m * rate, rate};
}

}  // namespace dive::estimation
