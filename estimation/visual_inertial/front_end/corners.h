#pragma once
// New features: corners of an image (smaller eigenvalue of the gradients' second moments; Shi and
// Tomasi, "Good features to track", 1994), spread over a grid of cells.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "estimation/visual_inertial/front_end/klt.h"

namespace dive::estimation {

struct CornerOptions {
  double min_gradient =
      4.0;  ///< Grey levels per pixel of the half-size image, in the weaker direction.
  double min_distance_px = 12.0;  ///< Distance of two features in the image.
};

/// A grid of nearly square cells with two features each.
class CornerGrid {
 public:
  static constexpr int kPerCell = 2;

  /// Finds none nearer than `border_px` to the edge.
  CornerGrid(CornerOptions options, int width, int height, int max_features, int border_px);

  [[nodiscard]] int cells() const { return columns_ * rows_; }

  /// Up to `wanted` corners in cells with fewer than two of `taken`, searching at most `max_cells`
  /// of those; the next call continues with the following cells. `half`: the image at half the size
  /// (halve()). An error is an exception of OpenCV.
  [[nodiscard]] tl::expected<std::vector<Eigen::Vector2f>, std::string> find(
      const GrayView& half, const std::vector<Eigen::Vector2f>& taken, int wanted, int max_cells);

 private:
  [[nodiscard]] int cell_of(const Eigen::Vector2f& pixel) const;
  void find_in(const GrayView& half, int cell, int count, std::vector<Eigen::Vector2f>& all) const;

  CornerOptions options_;
  int width_;
  int height_;
  int border_;
  int columns_;
  int rows_;
  int next_ = 0;
};

}  // namespace dive::estimation
