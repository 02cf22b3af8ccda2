#pragma once
// What the stereo pair sees, as the sweep of a range sensor: block matching at half the size (sum
// of absolute differences of Sobel gradients; OpenCV's StereoBM) with a left-right, a uniqueness
// and a speckle check, then each ray's disparity to a fraction of a pixel (disparity.h). Derivation
// and figures: doc/visual-inertial/stereo-range.md.
//
// With b between the eyes and f in pixels, a disparity d of one sigma s puts a point that is r away
//
//   r (1 +- s / d),   at most +- r^2 s / (f b):   so sigma_r <= noise_square() r^2
//
// which bounds how far the pair can be trusted. What is not matched is not told: water without
// texture gives NaN, never "free". The error of the vehicle's pose is not in it.

#include <memory>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "common/range_scan.h"

namespace dive::estimation {

struct StereoRangeOptions {
  int columns = 100;            ///< Of rays.
  int rows = 75;                ///< Of rays.
  double min_depth_m = 0.35;    ///< Along the optical axis; nearer nothing is matched.
  double calibration_px = 0.1;  ///< One sigma of a disparity, of the cameras' model.
  double optimism = 1.5;        ///< Errors are so many times what the noise in a window says.
  double most_sigma_px = 0.25;  ///< A disparity less sure than that tells nothing.
  double trusted_share = 0.05;  ///< Trusted as far as most_sigma_px is that much of the range ...
  double max_reach_m = 10.0;    ///< ... and no farther than that.
  int uniqueness_percent = 12;  ///< By which the best match must beat all others.
  int speckle_px = 120;         ///< Smaller patches of the half picture are left out.
  int texture = 150;            ///< Sum of Sobel gradients a block must have at least.

  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
};

struct StereoScan {
  RangeScan scan;  ///< Row by row from the top, columns * rows rays.
  /// One sigma along the ray, m; NaN where nothing is told. Farther than the reach: infinity.
  std::vector<float> sigma_m;
  int told = 0;    ///< Rays that met something within the reach,
  int beyond = 0;  ///< and those that surely met something farther.
};

class StereoRange {
 public:
  /// Demands options that validate. An error is rectify()'s. OpenCV is told to use one thread.
  [[nodiscard]] static tl::expected<StereoRange, std::string> create(StereoRangeOptions options,
                                                                     const CameraModel& left,
                                                                     const CameraModel& right);
  StereoRange(StereoRange&&) noexcept;
  StereoRange& operator=(StereoRange&&) noexcept;
  ~StereoRange();

  /// Of a pair taken at one moment, grey. Deterministic. An error is a sentence: pictures that are
  /// not as agreed or more than a millisecond apart, or what OpenCV threw.
  [[nodiscard]] tl::expected<StereoScan, std::string> look(const ImageFrame& left,
                                                           const ImageFrame& right);

  /// RangeScan::reach of all scans, m.
  [[nodiscard]] double reach() const;
  /// For MapperOptions::noise_square, 1/m: no point that is told is less sure.
  [[nodiscard]] double noise_square() const;
  /// Whether cameras that have been calibrated anew still are those it was made for: nowhere in the
  /// picture is a pixel off by more than half of calibration_px. Where not, make another.
  [[nodiscard]] bool fits(const CameraModel& left, const CameraModel& right) const;

 private:
  struct Impl;
  explicit StereoRange(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::estimation
