#include "mission/drawing/svg_legend.h"

#include <algorithm>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "mission/drawing/svg_labels.h"
#include "mission/drawing/svg_style.h"

namespace dive::mission {
namespace {

constexpr TextStyle kTitleStyle{.size = 15.0, .fill = "#111111", .bold = true};
constexpr TextStyle kRow{.size = 13.0};
constexpr double kSymbolWidth = 32.0;

class Legend {
 public:
  Legend(SvgCanvas& canvas, const DiveDrawing& drawing, const Eigen::Vector2d& top_left,
         double right)
      : canvas_(canvas), drawing_(drawing), left_(top_left.x()), right_(right), y_(top_left.y()) {}

  double draw() {
    draw_legs();
    y_ += 30.0;
    canvas_.text({left_, y_}, "Legend", kTitleStyle);
    y_ += 3.0;
    draw_line_symbols();
    draw_obstacle_symbols();
    return y_;
  }

 private:
  void draw_legs() {
    constexpr std::size_t kMaxRows = 24;
    const TextStyle column{.size = 12.0, .anchor = "end", .fill = "#555555"};
    canvas_.text({left_, y_}, "Legs", kTitleStyle);
    canvas_.text({right_ - 72.0, y_}, "length", column);
    canvas_.text({right_, y_}, "clearance", column);
    for (std::size_t leg = 0; leg < std::min(drawing_.legs.size(), kMaxRows); ++leg) draw_leg(leg);
    if (drawing_.legs.empty() || drawing_.legs.size() > kMaxRows) {
      y_ += 25.0;
      canvas_.text({left_, y_},
                   drawing_.legs.empty()
                       ? std::string("none planned")
                       : fmt::format("and {} more", drawing_.legs.size() - kMaxRows),
                   kRow);
    }
    if (drawing_.clearance_required_m > 0.0) {
      y_ += 25.0;
      canvas_.text({right_, y_}, fmt::format("required: {}", metres(drawing_.clearance_required_m)),
                   column);
    }
  }

  void draw_leg(std::size_t leg) {
    const PlannedLeg& row = drawing_.legs[leg];
    y_ += 25.0;
    draw_badge(canvas_, {left_ + kBadgeRadius, y_ - 4.5}, leg);
    canvas_.text({left_ + 28.0, y_}, shortened(row.name, 13), kRow);
    TextStyle number{.size = 13.0, .anchor = "end"};
    canvas_.text({right_ - 72.0, y_}, metres(path_length(row.waypoints)), number);
    if (!(row.clearance_m >= drawing_.clearance_required_m)) {
      number.fill = kLimitColor;
      number.bold = true;
    }
    canvas_.text({right_, y_}, metres(row.clearance_m), number);
  }

  // Adds a row with its text and returns the position of its symbol.
  Eigen::Vector2d row(std::string_view text) {
    y_ += 23.0;
    canvas_.text({left_ + 44.0, y_}, text, kRow);
    return {left_, y_ - 4.5};
  }

  void stroke(std::string_view text, std::string_view attributes) {
    const Eigen::Vector2d p = row(text);
    canvas_.line(p, p + Eigen::Vector2d(kSymbolWidth, 0.0), attributes);
  }

  void swatch(std::string_view text, std::string_view attributes) {
    const Eigen::Vector2d p = row(text);
    canvas_.rect(p - Eigen::Vector2d(0.0, 7.0), {kSymbolWidth, 14.0}, attributes);
  }

  void draw_line_symbols() {
    if (!drawing_.legs.empty()) {
      stroke("planned path, waypoints",
             fmt::format("stroke=\"{}\" stroke-width=\"2\"", leg_color(0)));
      canvas_.circle({left_ + 0.5 * kSymbolWidth, y_ - 4.5}, 2.6,
                     fmt::format("fill=\"{}\"", leg_color(0)));
    }
    if (std::ranges::any_of(drawing_.legs, [](const auto& leg) { return leg.narrow_m > 0.0; })) {
      stroke("less than the clearance", kNarrow);
    }
    if (!drawing_.legs.empty() && drawing_.hull != nullptr) {
      swatch("hull swept along it", fmt::format("fill=\"{}\" fill-opacity=\"0.28\"", leg_color(0)));
    }
    if (!drawing_.swum.empty()) stroke("path swum (truth)", kSwum);
    if (!drawing_.estimated.empty()) stroke("path estimated", kEstimated);
    if (!drawing_.errors.empty()) {
      const Eigen::Vector2d p = row("next waypoint (error diagram)");
      const Eigen::Vector2d middle = p + Eigen::Vector2d(0.5 * kSymbolWidth, 0.0);
      canvas_.line(middle - Eigen::Vector2d(0.0, 6.0), middle + Eigen::Vector2d(0.0, 6.0),
                   kWaypointTick);
    }
    if (!drawing_.collisions.empty()) {
      const Eigen::Vector2d p = row("collision: obstacle, time");
      draw_collision_mark(canvas_, p + Eigen::Vector2d(0.5 * kSymbolWidth, 0.0));
    }
  }

  void draw_obstacle_symbols() {
    if (drawing_.world == nullptr || drawing_.world->obstacles.empty()) return;
    if (drawing_.legs.empty() && drawing_.swum.empty()) {
      swatch("obstacle", kBehind);
      return;
    }
    swatch("obstacle", kBeside);
    swatch("obstacle behind the path", kBehind);
    swatch("obstacle in front of it, overhead", kInFront);
  }

  SvgCanvas& canvas_;
  const DiveDrawing& drawing_;
  double left_;
  double right_;
  double y_;
};

}  // namespace

double draw_legend(SvgCanvas& canvas, const DiveDrawing& drawing, const Eigen::Vector2d& top_left,
                   double right) {
  return Legend(canvas, drawing, top_left, right).draw();
}

}  // namespace dive::mission
