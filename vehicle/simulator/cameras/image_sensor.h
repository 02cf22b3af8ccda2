#pragma once
// From radiances to grey values: vignetting, exposure, shot noise, read noise, 8 bits.
//
//   electrons = electrons_per_ms * exposure * radiance * cos^(4 vignetting) of the off-axis angle
//   grey = 255 * gain * (electrons + noise) / full_well,  noise^2 = electrons + read_noise^2
//
// as in the EMVA 1288 model of a linear camera; no gamma. Pixels to which no ray belongs are dark.
// The figures are those of a global shutter sensor of this resolution (On Semiconductor MT9V034
// class).

#include <cstdint>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/clock.h"

namespace dive::vehicle {

struct ImageSensorOptions {
  bool automatic = true;  ///< Automatic exposure; otherwise exposure_ms and gain are fixed.
  double exposure_ms = 2.0;
  double gain = 1.0;
  double shortest_ms = 0.02;  ///< Limits of the automatic exposure time, which is lengthened first.
  double longest_ms = 15.0;
  double highest_gain = 8.0;            ///< Limit of the gain, raised after the exposure time.
  double lag_s = 0.25;                  ///< Time constant of the automatic exposure.
  double target = 0.35;                 ///< Target of the mean grey value, as a fraction of 1.
  double electrons_per_ms = 200'000.0;  ///< At radiance 1: a white surface in the sun, at f/2.
  double full_well = 10'000.0;          ///< Full-well capacity, electrons.
  double read_noise = 15.0;             ///< Read noise, electrons.
  bool shot_noise = true;
  double vignetting = 0.3;  ///< Fraction of the exponent 4, reduced in wide lenses; 0: none.

  /// A description of the first error; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
};

/// Shutter and gain for one image.
struct Exposure {
  double ms = 0.0;
  double gain = 1.0;
};

/// Automatic exposure of a pair of cameras with equal exposure. The first image is exposed
/// correctly, as after a long time of running.
class AutoExposure {
 public:
  explicit AutoExposure(ImageSensorOptions options) : options_(options) {}

  /// Sets the exposure from the image's own light, for an image without predecessors.
  void settle(double mean_radiance);
  /// Updates with the mean grey value (of 1) of an image taken at `now`.
  void observe(Utime now, double mean_grey);
  [[nodiscard]] bool is_settled() const { return product_ > 0.0; }
  [[nodiscard]] Exposure now() const;

 private:
  [[nodiscard]] double limited(double product) const;

  ImageSensorOptions options_;
  double product_ = 0.0;  // exposure, ms, times gain
  Utime utime_ = 0;
};

class ImageSensor {
 public:
  ImageSensor(const CameraModel& camera, ImageSensorOptions options);

  /// Converts radiances, row by row, to grey values. `key` selects the noise. Returns the mean grey
  /// value, of 1.
  double develop(const std::vector<float>& radiance, const Exposure& exposure, std::uint64_t key,
                 std::vector<std::uint8_t>& pixels) const;
  /// Mean after vignetting.
  [[nodiscard]] double mean(const std::vector<float>& radiance) const;

 private:
  ImageSensorOptions options_;
  std::vector<float> vignette_;
};

}  // namespace dive::vehicle
