#pragma once
// A place as it looked: points of the picture that can be found again, each with a descriptor (ORB:
// Rublee, Rabaud, Konolige, Bradski, "ORB: an efficient alternative to SIFT or SURF", 2011) and
// with where the right camera saw it.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "common/measurements.h"

namespace dive::estimation {

using Descriptor = std::array<std::uint64_t, 4>;  ///< 256 bits.

/// Bits in which they differ.
[[nodiscard]] int distance(const Descriptor& a, const Descriptor& b);

/// Normalised, undistorted image coordinates.
struct PlacePoint {
  Eigen::Vector2d left;
  std::optional<Eigen::Vector2d> right;
  Descriptor descriptor{};
};

struct PlaceView {
  Utime utime = 0;
  std::vector<PlacePoint> points;  ///< The clearest first.
};

struct PlaceViewerOptions {
  int max_points = 400;
  double min_depth_m = 0.25;  ///< Nearer points are not matched in stereo.

  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
};

class PlaceViewer {
 public:
  /// Demands options and cameras that validate, of one size, some distance apart.
  PlaceViewer(PlaceViewerOptions options, const CameraModel& left, const CameraModel& right);
  PlaceViewer(PlaceViewer&&) noexcept;
  PlaceViewer& operator=(PlaceViewer&&) noexcept;
  ~PlaceViewer();

  /// Of a pair of grey pictures, after contrast has been evened out. Deterministic. An error is a
  /// sentence: pictures not as agreed, or what a library threw.
  [[nodiscard]] tl::expected<PlaceView, std::string> view(const ImageFrame& left,
                                                          const ImageFrame& right);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Pairs (index in a, index in b) of which each is the other's best match, at most `most` bits
/// apart and clearly nearer than the second best.
[[nodiscard]] std::vector<std::pair<std::size_t, std::size_t>> match(const PlaceView& a,
                                                                     const PlaceView& b, int most);

/// How many of the `first` clearest points of a are like one of b: a measure of likeness that is
/// cheap.
[[nodiscard]] int likeness(const PlaceView& a, const PlaceView& b, std::size_t first, int most);

}  // namespace dive::estimation
