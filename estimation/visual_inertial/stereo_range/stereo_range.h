#pragma once
// The stereo pair as a range sensor: block matching at half the size (sum of absolute differences
// of Sobel gradients; OpenCV's StereoBM) with a left-right, a uniqueness and a speckle check, then
// each ray's disparity to a fraction of a pixel (disparity.h). Derivation and figures:
// doc/visual-inertial/stereo-range.md.
//
// With b the baseline and f in pixels, a disparity d of one sigma s puts a point at range r at
//
//   r (1 +- s / d),   at most +- r^2 s / (f b):   so sigma_r <= noise_square() r^2
//
// which bounds the range of the pair. Unmatched pixels give no range: water without texture gives
// NaN, never "free". The error of the vehicle's pose is not included.

#include <memory>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "common/range_scan.h"

namespace dive::estimation {

struct StereoRangeOptions {
  int columns = 100;            ///< Number of ray columns.
  int rows = 75;                ///< Number of ray rows.
  double min_depth_m = 0.35;    ///< Minimum depth of a match along the optical axis.
  double calibration_px = 0.1;  ///< One sigma of a disparity by the camera model's error.
  double optimism = 1.5;        ///< Actual errors over those computed from a window's noise.
  double max_sigma_px = 0.25;   ///< Maximum sigma of a disparity that gives a range.
  double trusted_share = 0.05;  ///< Range error at max_sigma_px that limits the reach, relative.
  double max_reach_m = 10.0;    ///< Upper limit of the reach.
  int uniqueness_percent = 12;  ///< Margin by which the best match must beat all others.
  int speckle_px = 120;         ///< Patches of the half-size image below it are removed.
  int texture = 150;            ///< Minimum sum of Sobel gradients in a block.

  /// A description of the first error; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
};

struct StereoScan {
  RangeScan scan;  ///< Scan of columns * rows rays, row by row from the top.
  /// One sigma along the ray, m; NaN without a range. Beyond the reach: infinity.
  std::vector<float> sigma_m;
  int measured = 0;  ///< Number of rays with a range within the reach.
  int beyond = 0;    ///< Number of rays with a match surely beyond it.
};

class StereoRange {
 public:
  /// Demands options that validate. An error is rectify()'s. Restricts OpenCV to one thread.
  [[nodiscard]] static tl::expected<StereoRange, std::string> create(StereoRangeOptions options,
                                                                     const CameraModel& left,
                                                                     const CameraModel& right);
  StereoRange(StereoRange&&) noexcept;
  StereoRange& operator=(StereoRange&&) noexcept;
  ~StereoRange();

  /// Scan of a grey pair taken at one time. Deterministic. An error is a sentence: unexpected
  /// images, or more than a millisecond apart, or an exception of OpenCV.
  [[nodiscard]] tl::expected<StereoScan, std::string> measure(const ImageFrame& left,
                                                              const ImageFrame& right);

  /// RangeScan::reach of all scans, m.
  [[nodiscard]] double reach() const;
  /// For RangeNoise::square, 1/m: an upper bound for every returned point.
  [[nodiscard]] double noise_square() const;
  /// True if recalibrated cameras still fit: no pixel of the image is off by more than half of
  /// calibration_px. Otherwise create a new object.
  [[nodiscard]] bool fits(const CameraModel& left, const CameraModel& right) const;

 private:
  struct Impl;
  explicit StereoRange(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::estimation
