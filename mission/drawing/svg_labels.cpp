#include "mission/drawing/svg_labels.h"

#include <array>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "mission/drawing/svg_style.h"

namespace dive::mission {
namespace {

constexpr double kOverLabel = 10.0;   // per px^2 shared with another label
constexpr double kOverPath = 8.0;     // per point of a path
constexpr double kOutOfFrame = 20.0;  // per px^2

double area(const Eigen::AlignedBox2d& box) { return box.isEmpty() ? 0.0 : box.volume(); }

}  // namespace

void draw_badge(SvgCanvas& canvas, const Eigen::Vector2d& centre, std::size_t leg) {
  canvas.circle(centre, kBadgeRadius,
                fmt::format("fill=\"{}\" stroke=\"#ffffff\" stroke-width=\"1.5\"", leg_color(leg)));
  canvas.text(centre + Eigen::Vector2d(0.0, 4.2), fmt::format("{}", leg + 1),
              {.size = 12.0, .anchor = "middle", .fill = "#ffffff", .bold = true});
}

void draw_collision_mark(SvgCanvas& canvas, const Eigen::Vector2d& centre) {
  constexpr double kHalf = 7.5;
  const Eigen::Vector2d rising(kHalf, -kHalf);
  const Eigen::Vector2d falling(kHalf, kHalf);
  for (const std::string& attributes :
       {std::string(R"(stroke="#ffffff" stroke-width="6.5")"),
        fmt::format("stroke=\"{}\" stroke-width=\"3.2\"", kLimitColor)}) {
    canvas.line(centre - rising, centre + rising, attributes);
    canvas.line(centre - falling, centre + falling, attributes);
  }
}

Eigen::AlignedBox2d label_box(const Eigen::Vector2d& place, std::string_view text, double size,
                              std::string_view anchor) {
  const double width = text_width(text, size);
  double left = place.x();
  if (anchor == "middle") left -= 0.5 * width;
  if (anchor == "end") left -= width;
  return {Eigen::Vector2d(left, place.y() - 0.85 * size),
          Eigen::Vector2d(left + width, place.y() + 0.25 * size)};
}

LabelPlacer::LabelPlacer(const Panel& panel, std::vector<Eigen::AlignedBox2d> occupied)
    : frame_(panel.top_left, panel.top_left + panel.size), occupied_(std::move(occupied)) {}

double LabelPlacer::harm(const Eigen::AlignedBox2d& box) const {
  double sum = kOutOfFrame * (area(box) - area(box.intersection(frame_)));
  for (const Eigen::AlignedBox2d& other : occupied_) {
    sum += kOverLabel * area(box.intersection(other));
  }
  for (const Eigen::Vector2d& p : avoided_) sum += box.contains(p) ? kOverPath : 0.0;
  return sum;
}

PlacedLabel LabelPlacer::place(const Eigen::Vector2d& p, std::string_view text, double size) {
  // Right, left, above, below, the corners, then the same farther away: in order of preference.
  struct Candidate {
    double x;
    double y;
    std::string_view anchor;
  };
  static constexpr std::array<Candidate, 8> kAround{{{12, 5, "start"},
                                                     {-12, 5, "end"},
                                                     {0, -13, "middle"},
                                                     {0, 24, "middle"},
                                                     {10, -10, "start"},
                                                     {10, 21, "start"},
                                                     {-10, -10, "end"},
                                                     {-10, 21, "end"}}};
  PlacedLabel best{p, "start"};
  double least = std::numeric_limits<double>::infinity();
  for (const double farther : {1.0, 1.8, 2.8}) {
    for (const Candidate& candidate : kAround) {
      const Eigen::Vector2d place =
          p +
          Eigen::Vector2d(candidate.x, candidate.y + (farther - 1.0) * (candidate.y > 6.0   ? size
                                                                        : candidate.y < 0.0 ? -size
                                                                                            : 0.0));
      const double cost =
          harm(label_box(place, text, size, candidate.anchor)) + 20.0 * (farther - 1.0);
      if (cost < least) {
        least = cost;
        best = {place, candidate.anchor};
      }
    }
  }
  occupied_.push_back(label_box(best.place, text, size, best.anchor));
  const Eigen::Vector2d mark = Eigen::Vector2d::Constant(8.0);
  occupied_.emplace_back(p - mark, p + mark);
  return best;
}

std::optional<Eigen::Vector2d> LabelPlacer::place_badge(const Points2& line) {
  double length = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
  if (!(length > 0.0)) return std::nullopt;
  std::optional<Eigen::Vector2d> best;
  double least = std::numeric_limits<double>::infinity();
  // Positions along the line, from the middle outwards.
  for (const double share : {0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74, 0.18, 0.82}) {
    double left = share * length;
    for (std::size_t i = 1; i < line.size(); ++i) {
      const double step = (line[i] - line[i - 1]).norm();
      if (left > step || !(step > 0.0)) {
        left -= step;
        continue;
      }
      const Eigen::Vector2d p = line[i - 1] + (line[i] - line[i - 1]) * (left / step);
      const Eigen::Vector2d half = Eigen::Vector2d::Constant(kBadgeRadius + 2.0);
      double cost = frame_.contains(p) ? 0.0 : 1e6;
      for (const Eigen::AlignedBox2d& other : occupied_) {
        cost += area(Eigen::AlignedBox2d(p - half, p + half).intersection(other));
      }
      if (cost < least) {
        least = cost;
        best = p;
      }
      break;
    }
  }
  if (best) {
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(kBadgeRadius);
    occupied_.emplace_back(*best - half, *best + half);
  }
  return best;
}

}  // namespace dive::mission
