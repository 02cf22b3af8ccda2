#include "mission/drawing/svg.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "mission/drawing/svg_canvas.h"
#include "mission/drawing/svg_labels.h"
#include "mission/drawing/svg_legend.h"
#include "mission/drawing/svg_scene.h"
#include "mission/drawing/svg_style.h"

namespace dive::mission {
namespace {

constexpr double kWidth = 1400.0;
constexpr double kLeft = 76.0;
constexpr double kRight = 320.0;  // width of the legend
constexpr double kTitle = 56.0;
constexpr double kHeading = 34.0;   // above each panel
constexpr double kAxisRoom = 48.0;  // below each panel
constexpr double kViewHeight = 720.0;
constexpr double kErrorHeight = 250.0;

// Runs of drawable points: an invalid sample interrupts the line.
std::vector<Points2> runs_of(const std::vector<Eigen::Vector3d>& track, const Projection& view) {
  std::vector<Points2> runs(1);
  for (const Eigen::Vector3d& p : track) {
    if (drawable(p)) {
      runs.back().push_back(view(p));
    } else if (!runs.back().empty()) {
      runs.emplace_back();
    }
  }
  return runs;
}

// The first `length_m` of a track; empty for an empty track.
std::vector<Eigen::Vector3d> beginning(const std::vector<Eigen::Vector3d>& track, double length_m) {
  if (track.empty() || !(length_m > 0.0)) return {};
  std::vector<Eigen::Vector3d> part = {track.front()};
  for (std::size_t i = 1; i < track.size(); ++i) {
    const Eigen::Vector3d step = track[i] - track[i - 1];
    const double length = step.norm();
    if (!(length < length_m)) {
      part.push_back(track[i - 1] + length_m / length * step);
      break;
    }
    part.push_back(track[i]);
    length_m -= length;
  }
  return part;
}

class Drawing {
 public:
  explicit Drawing(const DiveDrawing& drawing)
      : drawing_(drawing), region_(region_of_interest(drawing)), paths_(path_samples(drawing)) {}

  std::string render() {
    const Eigen::Vector3d span = region_.sizes();
    const double scale =
        std::min((kWidth - kLeft - kRight) / span.x(), kViewHeight / std::max(span.y(), span.z()));
    canvas_.text({kLeft - 48.0, 34.0}, shortened(drawing_.title, 90),
                 {.size = 21.0, .fill = "#111111", .bold = true});
    double bottom = kTitle;
    bottom = draw_view("Top view", kFromAbove, scale, bottom, "x, east (m)", "y, north (m)");
    bottom = draw_view("Side view, from the south", kFromSouth, scale, bottom, "x, east (m)",
                       "z, up (m)");
    if (!drawing_.errors.empty()) bottom = draw_error_diagram(bottom);
    const double legend_bottom =
        draw_legend(canvas_, drawing_, {kWidth - kRight + 24.0, kTitle + 21.0}, kWidth - 20.0);
    return canvas_.document(kWidth, std::max(bottom, legend_bottom) + 16.0, drawing_.title);
  }

 private:
  void heading(std::string_view text, double top) {
    canvas_.text({kLeft, top + 21.0}, text, {.size = 15.0, .fill = "#111111", .bold = true});
  }

  // Draws one view below `top`; returns its lower end.
  double draw_view(std::string_view title, const Projection& view, double scale, double top,
                   std::string_view u_title, std::string_view v_title) {
    heading(title, top);
    const Eigen::Vector2d low = view(region_.min());
    const Eigen::Vector2d high = view(region_.max());
    const Panel panel{{kLeft, top + kHeading}, scale * (high - low), low, high};
    const std::string clip_id = fmt::format("view{}", view.v);
    canvas_.clip(clip_id, panel.top_left, panel.size);
    canvas_.open_group(fmt::format("clip-path=\"url(#{})\"", clip_id));
    draw_water(panel, view);
    draw_obstacles(panel, view);
    draw_sweeps(panel, view);
    draw_overheads(panel, view);
    draw_tracks(panel, view);
    draw_labels(panel, view);
    canvas_.close_group();
    draw_axes(canvas_, panel, u_title, v_title);
    return panel.top_left.y() + panel.size.y() + kAxisRoom;
  }

  void draw_water(const Panel& panel, const Projection& view) {
    constexpr std::string_view kWater = R"(fill="#eef6fb")";
    const bool from_above = view.v != 2;
    const double surface = panel.to_pixels(Eigen::Vector2d(panel.low.x(), 0.0)).y();
    if (from_above || surface <= panel.top_left.y()) {
      canvas_.rect(panel.top_left, panel.size, kWater);
      return;
    }
    const double bottom = panel.top_left.y() + panel.size.y();
    if (surface >= bottom) return;
    canvas_.rect({panel.top_left.x(), surface}, {panel.size.x(), bottom - surface}, kWater);
    canvas_.line({panel.top_left.x(), surface}, {panel.top_left.x() + panel.size.x(), surface},
                 R"(stroke="#2a7ab0" stroke-width="2")");
    const Eigen::Vector2d place(panel.top_left.x() + panel.size.x() - 8.0, surface + 16.0);
    canvas_.text(place, "surface", {.size = 12.0, .anchor = "end", .fill = "#2a7ab0"});
    occupied_.clear();
    occupied_.push_back(label_box(place, "surface", 12.0, "end"));
  }

  void draw_obstacles(const Panel& panel, const Projection& view) {
    if (drawing_.world == nullptr) return;
    for (const Standing standing : {Standing::kBehind, Standing::kBeside}) {
      for (const planning::Obstacle& obstacle : drawing_.world->obstacles) {
        const Outline outline = outline_of(obstacle, view, paths_, region_);
        if (outline.standing != standing) continue;
        canvas_.polygon(panel.to_pixels(outline.corners),
                        standing == Standing::kBehind ? kBehind : kBeside);
      }
    }
  }

  void draw_overheads(const Panel& panel, const Projection& view) {
    if (drawing_.world == nullptr) return;
    for (const planning::Obstacle& obstacle : drawing_.world->obstacles) {
      const Outline outline = outline_of(obstacle, view, paths_, region_);
      if (outline.standing != Standing::kInFront) continue;
      canvas_.polygon(panel.to_pixels(outline.corners), kInFront);
    }
  }

  void draw_sweeps(const Panel& panel, const Projection& view) {
    for (std::size_t leg = 0; leg < drawing_.legs.size() && drawing_.hull != nullptr; ++leg) {
      // The group's opacity merges overlapping polygons into one area.
      canvas_.open_group(fmt::format("opacity=\"0.28\" fill=\"{}\"", leg_color(leg)));
      for (const Points2& polygon : sweep_of(drawing_.legs[leg].waypoints, *drawing_.hull, view)) {
        canvas_.polygon(panel.to_pixels(polygon), "");
      }
      canvas_.close_group();
    }
  }

  void draw_tracks(const Panel& panel, const Projection& view) {
    for (std::size_t leg = 0; leg < drawing_.legs.size(); ++leg) {
      std::vector<Eigen::Vector3d> line;
      for (const Pose& pose : drawing_.legs[leg].waypoints) line.push_back(pose.p);
      for (const Points2& run : runs_of(beginning(line, drawing_.legs[leg].narrow_m), view)) {
        canvas_.polyline(panel.to_pixels(run), kNarrow);
      }
      for (const Points2& run : runs_of(line, view)) {
        canvas_.polyline(panel.to_pixels(run),
                         fmt::format("stroke=\"{}\" stroke-width=\"2\"", leg_color(leg)));
        for (const Eigen::Vector2d& p : panel.to_pixels(run)) {
          canvas_.circle(p, 2.6, fmt::format("fill=\"{}\"", leg_color(leg)));
        }
      }
    }
    for (const Points2& run : runs_of(drawing_.swum, view)) {
      canvas_.polyline(panel.to_pixels(run), kSwum);
    }
    for (const Points2& run : runs_of(drawing_.estimated, view)) {
      canvas_.polyline(panel.to_pixels(run), kEstimated);
    }
  }

  // Numbers on the legs, names at the goals and at the start, placed to cover as little as
  // possible.
  void draw_labels(const Panel& panel, const Projection& view) {
    LabelPlacer placer(panel, occupied_);
    for (const Eigen::Vector3d& p : paths_) placer.avoid(panel.to_pixels(view(p)));
    for (const auto& [name, p] : drawing_.goals) {
      if (drawable(p)) draw_goal(placer, panel.to_pixels(view(p)), name);
    }
    draw_start(placer, panel, view);
    draw_collisions(placer, panel, view);
    for (std::size_t leg = 0; leg < drawing_.legs.size(); ++leg) {
      Points2 line;
      for (const Pose& pose : drawing_.legs[leg].waypoints) {
        if (drawable(pose.p)) line.push_back(panel.to_pixels(view(pose.p)));
      }
      const std::optional<Eigen::Vector2d> place = placer.place_badge(line);
      if (place) draw_badge(canvas_, *place, leg);
    }
    occupied_.clear();
  }

  void draw_goal(LabelPlacer& placer, const Eigen::Vector2d& p, std::string_view name) {
    constexpr double kHalf = 7.0;
    canvas_.polygon({p + Eigen::Vector2d(0, -kHalf), p + Eigen::Vector2d(kHalf, 0),
                     p + Eigen::Vector2d(0, kHalf), p + Eigen::Vector2d(-kHalf, 0)},
                    R"(fill="#ffffff" stroke="#1a1a1a" stroke-width="2")");
    draw_place_name(placer, p, shortened(name, 24));
  }

  void draw_start(LabelPlacer& placer, const Panel& panel, const Projection& view) {
    const Eigen::Vector3d* start = nullptr;
    if (!drawing_.swum.empty()) {
      start = &drawing_.swum.front();
    } else if (!drawing_.legs.empty() && !drawing_.legs.front().waypoints.empty()) {
      start = &drawing_.legs.front().waypoints.front().p;
    }
    if (start == nullptr || !drawable(*start)) return;
    const Eigen::Vector2d p = panel.to_pixels(view(*start));
    canvas_.circle(p, 5.5, R"(fill="#1a1a1a" stroke="#ffffff" stroke-width="1.5")");
    const bool has_name =
        std::any_of(drawing_.goals.begin(), drawing_.goals.end(),
                    [start](const auto& goal) { return (goal.second - *start).norm() < 0.1; });
    if (!has_name) draw_place_name(placer, p, "start");
  }

  // The marks of all collisions, the names of the first few.
  void draw_collisions(LabelPlacer& placer, const Panel& panel, const Projection& view) {
    constexpr std::size_t kMaxNamed = 8;
    for (std::size_t i = 0; i < drawing_.collisions.size(); ++i) {
      const Collision& collision = drawing_.collisions[i];
      if (!drawable(collision.p_W)) continue;
      const Eigen::Vector2d p = panel.to_pixels(view(collision.p_W));
      draw_collision_mark(canvas_, p);
      if (i >= kMaxNamed) continue;
      draw_place_name(placer, p,
                      fmt::format("{}, {:.1f} s", shortened(collision.obstacle, 36), collision.t_s),
                      kLimitColor);
    }
  }

  void draw_place_name(LabelPlacer& placer, const Eigen::Vector2d& p, std::string_view text,
                       std::string_view color = "#111111") {
    const PlacedLabel label = placer.place(p, text, 14.0);
    canvas_.text(label.place, text,
                 {.size = 14.0, .anchor = label.anchor, .fill = color, .bold = true, .halo = true});
  }

  double draw_error_diagram(double top) {
    heading("Distance to the line between waypoints", top);
    Points2 line;
    double end = 0.0;
    double highest = std::max(0.0, drawing_.clearance_required_m);
    for (const ErrorSample& sample : drawing_.errors) {
      if (!std::isfinite(sample.t_s) || !std::isfinite(sample.error_m)) continue;
      line.emplace_back(sample.t_s, sample.error_m);
      end = std::max(end, sample.t_s);
      highest = std::max(highest, sample.error_m);
    }
    for (const Collision& collision : drawing_.collisions) end = std::max(end, collision.t_s);
    const Panel panel{{kLeft, top + kHeading},
                      {kWidth - kLeft - kRight, kErrorHeight},
                      {0.0, 0.0},
                      {std::max(end, 1.0), std::max(1.15 * highest, 0.1)}};
    canvas_.clip("errors", panel.top_left, panel.size);
    canvas_.open_group("clip-path=\"url(#errors)\"");
    for (const ErrorSample& sample : drawing_.errors) {
      if (!sample.new_waypoint || !std::isfinite(sample.t_s)) continue;
      const double x = panel.to_pixels(Eigen::Vector2d(sample.t_s, 0.0)).x();
      const double bottom = panel.top_left.y() + panel.size.y();
      canvas_.line({x, bottom}, {x, bottom - 12.0}, kWaypointTick);
    }
    draw_required(panel);
    canvas_.polyline(panel.to_pixels(line), kSwum);
    for (const Collision& collision : drawing_.collisions) {
      const double x = panel.to_pixels(Eigen::Vector2d(collision.t_s, 0.0)).x();
      const double top_y = panel.top_left.y();
      canvas_.line({x, top_y}, {x, top_y + panel.size.y()},
                   fmt::format("stroke=\"{}\" stroke-width=\"1.2\"", kLimitColor));
      draw_collision_mark(canvas_, {x, top_y + 16.0});
    }
    canvas_.close_group();
    draw_axes(canvas_, panel, "time (s)", "error (m)");
    return panel.top_left.y() + panel.size.y() + kAxisRoom;
  }

  void draw_required(const Panel& panel) {
    if (!(drawing_.clearance_required_m > 0.0)) return;
    const Eigen::Vector2d from = panel.to_pixels({0.0, drawing_.clearance_required_m});
    canvas_.line(
        from, from + Eigen::Vector2d(panel.size.x(), 0.0),
        fmt::format("stroke=\"{}\" stroke-width=\"1.6\" stroke-dasharray=\"9 4\"", kLimitColor));
    canvas_.text(from + Eigen::Vector2d(panel.size.x() - 8.0, -6.0),
                 fmt::format("D_min = {}", metres(drawing_.clearance_required_m)),
                 {.size = 12.0, .anchor = "end", .fill = kLimitColor});
  }

  const DiveDrawing& drawing_;
  Eigen::AlignedBox3d region_;
  std::vector<Eigen::Vector3d> paths_;
  SvgCanvas canvas_;
  std::vector<Eigen::AlignedBox2d> occupied_;
};

}  // namespace

std::string render_svg(const DiveDrawing& drawing) { return Drawing(drawing).render(); }

}  // namespace dive::mission
