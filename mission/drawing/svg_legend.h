#pragma once
// The legend beside a drawing. Internal to mission/drawing.

#include "mission/drawing/svg.h"
#include "mission/drawing/svg_canvas.h"

namespace dive::mission {

/// Draws the legs with their length and certified clearance (red if less than required), and below
/// them the meaning of the lines and areas that occur in the drawing. Between `top_left` and
/// `right`, px; returns the lower end.
double draw_legend(SvgCanvas& canvas, const DiveDrawing& drawing, const Eigen::Vector2d& top_left,
                   double right);

}  // namespace dive::mission
