#pragma once
// From radiances to grey values: vignetting, exposure, shot noise, read noise, 8 bits.
//
//   electrons = electrons_per_ms * exposure * radiance * cos^(4 vignetting) of the angle to the
//   axis grey = 255 * gain * (electrons + noise) / full_well,  noise^2 = electrons + read_noise^2
//
// as in the EMVA 1288 model of a linear camera; no gamma. The figures are those of a global shutter
// sensor of this resolution (On Semiconductor MT9V034 class).

#include <cstdint>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/clock.h"

namespace dive::vehicle {

struct ImageSensorOptions {
  bool automatic = true;  ///< Else exposure_ms and gain hold.
  double exposure_ms = 2.0;
  double gain = 1.0;
  double shortest_ms = 0.02;  ///< The automatic exposure lengthens first ...
  double longest_ms = 15.0;
  double highest_gain = 8.0;            ///< ... and amplifies then.
  double lag_s = 0.25;                  ///< It closes in on its target with this time constant,
  double target = 0.35;                 ///< the mean grey value it seeks, of 1.
  double electrons_per_ms = 200'000.0;  ///< From radiance 1: a white thing in the sun, at f/2.
  double full_well = 10'000.0;          ///< Electrons.
  double read_noise = 15.0;             ///< Electrons.
  bool shot_noise = true;
  double vignetting = 0.3;  ///< Of the exponent 4: wide lenses are made to do better; 0: none.

  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
};

/// What the shutter and the amplifier do in one picture.
struct Exposure {
  double ms = 0.0;
  double gain = 1.0;
};

/// Automatic exposure of a pair of cameras that are exposed alike. The first picture is exposed
/// right, as by a camera that has been looking for a while.
class AutoExposure {
 public:
  explicit AutoExposure(ImageSensorOptions options) : options_(options) {}

  /// For a picture taken now, before which nothing has been told of others: from its own light.
  void settle(double mean_radiance);
  /// What a picture taken at `now` had as its mean grey value, of 1.
  void observe(Utime now, double mean_grey);
  [[nodiscard]] bool is_settled() const { return product_ > 0.0; }
  [[nodiscard]] Exposure now() const;

 private:
  [[nodiscard]] double limited(double product) const;

  ImageSensorOptions options_;
  double product_ = 0.0;  // of exposure, ms, and gain
  Utime utime_ = 0;
};

class ImageSensor {
 public:
  ImageSensor(const CameraModel& camera, ImageSensorOptions options);

  /// Of radiances, row by row. `key`: another one, another noise. Returns the mean grey value, of
  /// 1.
  double develop(const std::vector<float>& radiance, const Exposure& exposure, std::uint64_t key,
                 std::vector<std::uint8_t>& pixels) const;
  /// After vignetting.
  [[nodiscard]] double mean(const std::vector<float>& radiance) const;

 private:
  ImageSensorOptions options_;
  std::vector<float> vignette_;
};

}  // namespace dive::vehicle
