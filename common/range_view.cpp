#include "common/range_view.h"

#include <cmath>

#include "common/se3.h"

namespace dive {

Eigen::Quaterniond RangeView::q_BC() const { return from_rpy(0.0, deg_to_rad(tilt_deg), 0.0); }

PixelGrid::PixelGrid(const RangeView& view, int columns, int rows)
    : columns_(columns),
      rows_(rows),
      half_width_(std::tan(0.5 * deg_to_rad(view.horizontal_deg))),
      half_height_(std::tan(0.5 * deg_to_rad(view.vertical_deg))) {}

Eigen::Vector3d PixelGrid::centre(int column, int row) const {
  return {1.0, half_width_ * (1.0 - (2.0 * column + 1.0) / columns_),
          half_height_ * (1.0 - (2.0 * row + 1.0) / rows_)};
}

}  // namespace dive
