#pragma once
// The column beside a picture. Internal to the pictures.

#include "mission/record/svg.h"
#include "mission/record/svg_canvas.h"

namespace dive::mission {

/// The legs with their length and certified clearance (in red where it is less than required), and
/// below them what the lines and areas mean: only those that the picture has. Between `top_left`
/// and `right`, px; returns where it ends.
double draw_legend(SvgCanvas& canvas, const DivePicture& picture, const Eigen::Vector2d& top_left,
                   double right);

}  // namespace dive::mission
