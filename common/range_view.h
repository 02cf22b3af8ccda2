#pragma once
// What the Aqua2's range camera sees: its field of view and mount. Pinhole: the grid of pixels is
// uniform on the image plane, x = 1 in the camera's frame C (x along the optical axis, y left, z
// up). The centre of the pixel in column c and row r is
//
//   [1, tan(horizontal / 2) (1 - 2 (c + 1/2) / columns), tan(vertical / 2) (1 - 2 (r + 1/2) /
//   rows)]

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dive {

struct RangeView {
  double horizontal_deg = 120.0;
  double vertical_deg = 90.0;
  double tilt_deg = 40.0;                       ///< Tilt of the optical axis below x of B.
  Eigen::Vector3d origin_B = {0.31, 0.0, 0.0};  ///< m
  double reach_m = 10.0;

  /// R_BC = Ry(tilt_deg)
  [[nodiscard]] Eigen::Quaterniond q_BC() const;
};

class PixelGrid {
 public:
  PixelGrid(const RangeView& view, int columns, int rows);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  /// Of the image plane; half of its extents along y and z of C.
  [[nodiscard]] double half_width() const { return half_width_; }
  [[nodiscard]] double half_height() const { return half_height_; }
  /// In C.
  [[nodiscard]] Eigen::Vector3d centre(int column, int row) const;

 private:
  int columns_;
  int rows_;
  double half_width_;
  double half_height_;
};

}  // namespace dive
