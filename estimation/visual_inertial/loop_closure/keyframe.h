#pragma once
// The appearance of a place: image points that can be recognised, each with a descriptor (ORB:
// Rublee, Rabaud, Konolige, Bradski, "ORB: an efficient alternative to SIFT or SURF", 2011) and its
// position in the right camera.

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

/// Number of differing bits.
[[nodiscard]] int distance(const Descriptor& a, const Descriptor& b);

/// Normalised, undistorted image coordinates.
struct KeyframePoint {
  Eigen::Vector2d left;
  std::optional<Eigen::Vector2d> right;
  Descriptor descriptor{};
};

struct KeyframeView {
  Utime utime = 0;
  std::vector<KeyframePoint> points;  ///< The strongest first.
};

struct KeyframeExtractorOptions {
  int max_points = 400;
  double min_depth_m = 0.25;  ///< Minimum depth of a stereo match.

  /// A description of the first error; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
};

class KeyframeExtractor {
 public:
  /// Demands options and cameras that validate, of one size, some distance apart.
  KeyframeExtractor(KeyframeExtractorOptions options, const CameraModel& left,
                    const CameraModel& right);
  KeyframeExtractor(KeyframeExtractor&&) noexcept;
  KeyframeExtractor& operator=(KeyframeExtractor&&) noexcept;
  ~KeyframeExtractor();

  /// View of a pair of grey images, after equalising the contrast. Deterministic. An error is a
  /// sentence: unexpected images, or a library's exception.
  [[nodiscard]] tl::expected<KeyframeView, std::string> view(const ImageFrame& left,
                                                             const ImageFrame& right);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Pairs (index in a, index in b) that are each other's best match, at most `most` bits apart and
/// clearly nearer than the second best.
[[nodiscard]] std::vector<std::pair<std::size_t, std::size_t>> match(const KeyframeView& a,
                                                                     const KeyframeView& b,
                                                                     int most);

/// Number of the `first` strongest points of a that have a similar one in b: a cheap measure of
/// similarity.
[[nodiscard]] int likeness(const KeyframeView& a, const KeyframeView& b, std::size_t first,
                           int most);

}  // namespace dive::estimation
