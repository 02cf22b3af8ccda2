#include "vehicle/simulator/cameras/image_sensor.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/range_check.h"
#include "vehicle/simulator/ray_tracing/ray_batch.h"

namespace dive::vehicle {
namespace {

// Sum of four bytes of one hashed number: nearly normal (Irwin and Hall), with exact variance. Mean
// 0, variance 1.
DIVE_INLINE float unit_noise(std::uint32_t index, std::uint32_t key) {
  std::uint32_t h = index * 0x9e3779b9U ^ key;
  h ^= h >> 16U;
  h *= 0x7feb352dU;
  h ^= h >> 15U;
  h *= 0x846ca68bU;
  h ^= h >> 16U;
  const std::uint32_t sum = (h & 0xffU) + ((h >> 8U) & 0xffU) + ((h >> 16U) & 0xffU) + (h >> 24U);
  constexpr float kInverseSigma = 0.0067659F;  // sqrt(12 / (4 (256^2 - 1)))
  return (static_cast<float>(static_cast<std::int32_t>(sum)) - 510.0F) * kInverseSigma;
}

DIVE_VECTOR_LOOP void expose(const float* radiance, const float* vignette, std::size_t count,
                             float electrons_per_radiance, float shot, float read_variance,
                             float grey_per_electron, std::uint32_t key, std::uint8_t* pixels) {
  for (std::size_t i = 0; i < count; ++i) {
    const float electrons = electrons_per_radiance * vignette[i] * radiance[i];
    const float sigma = std::sqrt(shot * electrons + read_variance);
    const float noisy = electrons + sigma * unit_noise(static_cast<std::uint32_t>(i), key);
    const float grey = std::clamp(noisy * grey_per_electron + 0.5F, 0.0F, 255.0F);
    pixels[i] = static_cast<std::uint8_t>(static_cast<std::int32_t>(grey));
  }
}

}  // namespace

std::string ImageSensorOptions::validate() const {
  RangeCheck check;
  check("exposure_ms", exposure_ms, 1e-4, 1000);
  check("gain", gain, 1e-3, 1000);
  check("shortest_ms", shortest_ms, 1e-4, longest_ms);
  check("longest_ms", longest_ms, 1e-4, 1000);
  check("highest_gain", highest_gain, 1, 1000);
  check("lag_s", lag_s, 0, 100);
  check("target", target, 0.05, 0.9);
  check("electrons_per_ms", electrons_per_ms, 1, 1e9);
  check("full_well", full_well, 100, 1e7);
  check("read_noise", read_noise, 0, 1e4);
  check("vignetting", vignetting, 0, 4);
  return check.problem();
}

double AutoExposure::limited(double product) const {
  return std::clamp(product, options_.shortest_ms, options_.longest_ms * options_.highest_gain);
}

void AutoExposure::settle(double mean_radiance) {
  product_ = limited(options_.target * options_.full_well /
                     (options_.electrons_per_ms * std::max(mean_radiance, 1e-12)));
}

void AutoExposure::observe(Utime now, double mean_grey) {
  const double dt = std::max(0.0, to_seconds(now - utime_));
  utime_ = now;
  const double share = options_.lag_s > 0.0 ? -std::expm1(-dt / options_.lag_s) : 1.0;
  const double wanted = std::clamp(options_.target / std::max(mean_grey, 1e-3), 0.125, 8.0);
  product_ = limited(product_ * std::pow(wanted, share));
}

Exposure AutoExposure::now() const {
  if (!options_.automatic) return {options_.exposure_ms, options_.gain};
  const double ms = std::min(product_, options_.longest_ms);
  return {ms, product_ / ms};
}

ImageSensor::ImageSensor(const CameraModel& camera, ImageSensorOptions options)
    : options_(options) {
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const auto n = camera.undistort({1.0 * u, 1.0 * v});
      const double cosine = n ? 1.0 / std::sqrt(1.0 + n->squaredNorm()) : 0.0;
      const double share = n ? std::pow(cosine, 4.0 * options_.vignetting) : 0.0;
      vignette_.push_back(static_cast<float>(share));
    }
  }
}

double ImageSensor::develop(const std::vector<float>& radiance, const Exposure& exposure,
                            std::uint64_t key, std::vector<std::uint8_t>& pixels) const {
  pixels.resize(radiance.size());
  const auto folded = static_cast<std::uint32_t>(key ^ (key >> 32U));
  expose(radiance.data(), vignette_.data(), radiance.size(),
         static_cast<float>(options_.electrons_per_ms * exposure.ms),
         options_.shot_noise ? 1.0F : 0.0F,
         static_cast<float>(options_.read_noise * options_.read_noise),
         static_cast<float>(255.0 * exposure.gain / options_.full_well), folded, pixels.data());
  const auto sum = std::accumulate(pixels.begin(), pixels.end(), std::uint64_t{0});
  return static_cast<double>(sum) / (255.0 * static_cast<double>(pixels.size()));
}

double ImageSensor::mean(const std::vector<float>& radiance) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    sum += static_cast<double>(radiance[i] * vignette_[i]);
  }
  return sum / static_cast<double>(radiance.size());
}

}  // namespace dive::vehicle
