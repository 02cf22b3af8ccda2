#pragma once
// Places labels so that they cover neither each other nor the paths. Internal to mission/drawing.

#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "mission/drawing/svg_canvas.h"

namespace dive::mission {

inline constexpr double kBadgeRadius = 9.0;  ///< px

/// A leg's number on its colour, on the path and in the legend.
void draw_badge(SvgCanvas& canvas, const Eigen::Vector2d& centre, std::size_t leg);

/// A red cross at a contact.
void draw_collision_mark(SvgCanvas& canvas, const Eigen::Vector2d& centre);

struct PlacedLabel {
  Eigen::Vector2d place;  ///< Position of the text's baseline, px.
  std::string_view anchor;
};

/// The box covered by a text, px.
[[nodiscard]] Eigen::AlignedBox2d label_box(const Eigen::Vector2d& place, std::string_view text,
                                            double size, std::string_view anchor);

/// Places labels one after the other, each where it covers least.
class LabelPlacer {
 public:
  LabelPlacer(const Panel& panel, std::vector<Eigen::AlignedBox2d> occupied);

  /// A point of a path, px, that labels should not cover.
  void avoid(const Eigen::Vector2d& p) { avoided_.push_back(p); }
  /// A name beside a mark at `p`.
  [[nodiscard]] PlacedLabel place(const Eigen::Vector2d& p, std::string_view text, double size);
  /// A round badge on a line, apart from other labels; empty for a line without length.
  [[nodiscard]] std::optional<Eigen::Vector2d> place_badge(const Points2& line);

 private:
  [[nodiscard]] double harm(const Eigen::AlignedBox2d& box) const;

  Eigen::AlignedBox2d frame_;
  std::vector<Eigen::AlignedBox2d> occupied_;
  Points2 avoided_;
};

}  // namespace dive::mission
