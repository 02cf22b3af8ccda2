#pragma once
// Writes SVG elements and maps metres to pixels. Internal to mission/drawing.

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace dive::mission {

using Points2 = std::vector<Eigen::Vector2d>;

struct TextStyle {
  double size = 13.0;
  std::string_view anchor = "start";  ///< start, middle, end.
  std::string_view fill = "#333333";
  bool bold = false;
  bool halo = false;    ///< White outline, for text on top of a drawing.
  double rotate = 0.0;  ///< Rotation about the text's position, degrees.
};

/// All coordinates are in pixels, y down. Attributes are SVG's own and are not escaped.
class SvgCanvas {
 public:
  void open_group(std::string_view attributes);
  void close_group();
  void rect(const Eigen::Vector2d& top_left, const Eigen::Vector2d& size,
            std::string_view attributes);
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, std::string_view attributes);
  void circle(const Eigen::Vector2d& centre, double radius, std::string_view attributes);
  void polygon(const Points2& points, std::string_view attributes);
  /// Omits points within half a pixel of the last one drawn.
  void polyline(const Points2& points, std::string_view attributes);
  void text(const Eigen::Vector2d& place, std::string_view content, const TextStyle& style);
  /// Defines a clipping rectangle, to be used as clip-path="url(#id)".
  void clip(std::string_view id, const Eigen::Vector2d& top_left, const Eigen::Vector2d& size);

  /// The complete document.
  [[nodiscard]] std::string document(double width, double height, std::string_view title) const;

 private:
  std::string body_;
};

/// Text as XML content: markup escaped, control characters and broken UTF-8 replaced.
[[nodiscard]] std::string escape_xml(std::string_view text);

/// The text cut to `max_characters`, with an ellipsis where it was cut.
[[nodiscard]] std::string shortened(std::string_view text, std::size_t max_characters);

/// Upper estimate of the width of a text in the sans-serif font of SVG viewers, pixels.
[[nodiscard]] double text_width(std::string_view text, double size);

/// A rectangle of the drawing that shows a rectangle of the world, v up.
struct Panel {
  Eigen::Vector2d top_left;  ///< px
  Eigen::Vector2d size;      ///< px
  Eigen::Vector2d low;       ///< Value at the lower left corner: m, or s.
  Eigen::Vector2d high;

  [[nodiscard]] Eigen::Vector2d to_pixels(const Eigen::Vector2d& p) const;
  [[nodiscard]] Points2 to_pixels(const Points2& points) const;
};

/// Grid, frame, numbers at round steps and titles of both axes.
void draw_axes(SvgCanvas& canvas, const Panel& panel, std::string_view u_title,
               std::string_view v_title);

/// The number of the form 1, 2 or 5 times a power of ten with about `count` steps in `span`.
[[nodiscard]] double round_step(double span, int count);

}  // namespace dive::mission
