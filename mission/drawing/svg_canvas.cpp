#include "mission/drawing/svg_canvas.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace dive::mission {
namespace {

// Number of bytes of the UTF-8 sequence that starts here, 0 if it is invalid.
std::size_t sequence_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  std::size_t length = 0;
  if (byte(0) < 0x80) return 1;
  if (byte(0) >= 0xC2 && byte(0) < 0xE0) length = 2;
  if (byte(0) >= 0xE0 && byte(0) < 0xF0) length = 3;
  if (byte(0) >= 0xF0 && byte(0) < 0xF5) length = 4;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
  }
  // Overlong forms, surrogates, non-characters and code points beyond Unicode are not allowed in
  // XML either.
  if (byte(0) == 0xE0 && byte(1) < 0xA0) return 0;
  if (byte(0) == 0xED && byte(1) >= 0xA0) return 0;
  if (byte(0) == 0xEF && byte(1) == 0xBF && byte(2) >= 0xBE) return 0;
  if (byte(0) == 0xF0 && byte(1) < 0x90) return 0;
  if (byte(0) == 0xF4 && byte(1) >= 0x90) return 0;
  return length;
}

std::string coordinates(const Points2& points) {
  std::string text;
  for (const Eigen::Vector2d& p : points) {
    text += fmt::format("{}{:.2f},{:.2f}", text.empty() ? "" : " ", p.x(), p.y());
  }
  return text;
}

}  // namespace

void SvgCanvas::open_group(std::string_view attributes) {
  body_ += fmt::format("<g {}>\n", attributes);
}

void SvgCanvas::close_group() { body_ += "</g>\n"; }

void SvgCanvas::rect(const Eigen::Vector2d& top_left, const Eigen::Vector2d& size,
                     std::string_view attributes) {
  body_ += fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" {}/>\n",
                       top_left.x(), top_left.y(), size.x(), size.y(), attributes);
}

void SvgCanvas::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                     std::string_view attributes) {
  body_ += fmt::format("<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" {}/>\n",
                       from.x(), from.y(), to.x(), to.y(), attributes);
}

void SvgCanvas::circle(const Eigen::Vector2d& centre, double radius, std::string_view attributes) {
  body_ += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" {}/>\n", centre.x(),
                       centre.y(), radius, attributes);
}

void SvgCanvas::polygon(const Points2& points, std::string_view attributes) {
  if (points.size() < 3) return;
  body_ += fmt::format("<polygon points=\"{}\" {}/>\n", coordinates(points), attributes);
}

void SvgCanvas::polyline(const Points2& points, std::string_view attributes) {
  Points2 kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool is_end = i + 1 == points.size();
    if (kept.empty() || is_end || (points[i] - kept.back()).norm() > 0.5) kept.push_back(points[i]);
  }
  if (kept.size() < 2) return;
  body_ +=
      fmt::format("<polyline points=\"{}\" fill=\"none\" {}/>\n", coordinates(kept), attributes);
}

void SvgCanvas::text(const Eigen::Vector2d& place, std::string_view content,
                     const TextStyle& style) {
  std::string attributes =
      fmt::format("x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\"",
                  place.x(), place.y(), style.size, style.anchor, style.fill);
  if (style.bold) attributes += " font-weight=\"bold\"";
  if (style.rotate != 0.0) {
    attributes += fmt::format(" transform=\"rotate({:.1f} {:.2f} {:.2f})\"", style.rotate,
                              place.x(), place.y());
  }
  const std::string escaped = escape_xml(content);
  if (style.halo) {
    // The outline is a separate text: not every viewer supports paint-order.
    body_ += fmt::format(
        "<text {} stroke=\"#ffffff\" stroke-width=\"4\" stroke-linejoin=\"round\" "
        "aria-hidden=\"true\">{}</text>\n",
        attributes, escaped);
  }
  body_ += fmt::format("<text {}>{}</text>\n", attributes, escaped);
}

void SvgCanvas::clip(std::string_view id, const Eigen::Vector2d& top_left,
                     const Eigen::Vector2d& size) {
  body_ += fmt::format("<clipPath id=\"{}\">\n", id);
  rect(top_left, size, "");
  body_ += "</clipPath>\n";
}

std::string SvgCanvas::document(double width, double height, std::string_view title) const {
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"'DejaVu Sans', Verdana, Helvetica, Arial, sans-serif\">\n"
      "<title>{2}</title>\n"
      "<rect x=\"0\" y=\"0\" width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"#ffffff\"/>\n"
      "{3}</svg>\n",
      width, height, escape_xml(title), body_);
}

std::string escape_xml(std::string_view text) {
  std::string escaped;
  while (!text.empty()) {
    const std::size_t length = sequence_length(text);
    const char c = text.front();
    if (length == 0 || (length == 1 && (static_cast<unsigned char>(c) < 0x20 || c == 0x7F))) {
      escaped += ' ';
    } else if (c == '&') {
      escaped += "&amp;";
    } else if (c == '<') {
      escaped += "&lt;";
    } else if (c == '>') {
      escaped += "&gt;";
    } else if (c == '"') {
      escaped += "&quot;";
    } else {
      escaped += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return escaped;
}

std::string shortened(std::string_view text, std::size_t max_characters) {
  std::size_t at = 0;
  for (std::size_t count = 0; at < text.size(); ++count) {
    if (count + 1 == max_characters) {
      const std::size_t next = at + std::max<std::size_t>(sequence_length(text.substr(at)), 1);
      if (next >= text.size()) break;
      return std::string(text.substr(0, at)) + "…";
    }
    at += std::max<std::size_t>(sequence_length(text.substr(at)), 1);
  }
  return std::string(text);
}

double text_width(std::string_view text, double size) {
  double characters = 0.0;
  for (std::size_t at = 0; at < text.size(); characters += 1.0) {
    at += std::max<std::size_t>(sequence_length(text.substr(at)), 1);
  }
  return 0.62 * size * characters;
}

Eigen::Vector2d Panel::to_pixels(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d share = (p - low).cwiseQuotient(high - low);
  return top_left + Eigen::Vector2d(share.x() * size.x(), (1.0 - share.y()) * size.y());
}

Points2 Panel::to_pixels(const Points2& points) const {
  Points2 result;
  result.reserve(points.size());
  for (const Eigen::Vector2d& p : points) result.push_back(to_pixels(p));
  return result;
}

double round_step(double span, int count) {
  const double raw = span / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

void draw_axes(SvgCanvas& canvas, const Panel& panel, std::string_view u_title,
               std::string_view v_title) {
  constexpr double kPixelsPerStep = 55.0;
  constexpr std::string_view kGrid = R"(stroke="#000000" stroke-opacity="0.10" stroke-width="1")";
  const Eigen::Vector2d corner = panel.top_left + panel.size;
  const TextStyle numbers{.size = 12.0, .anchor = "middle", .fill = "#555555"};
  for (int axis = 0; axis < 2; ++axis) {
    const double span = panel.high[axis] - panel.low[axis];
    const int count = std::max(2, static_cast<int>(panel.size[axis] / kPixelsPerStep));
    const double step = round_step(span, count);
    const int digits = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
    const double first = std::ceil(panel.low[axis] / step - 1e-9);
    const double last = std::floor(panel.high[axis] / step + 1e-9);
    for (double k = first; k <= last; k += 1.0) {
      Eigen::Vector2d at = panel.low;
      at[axis] = k * step;
      const Eigen::Vector2d p = panel.to_pixels(at);
      const std::string number = fmt::format("{:.{}f}", k == 0.0 ? 0.0 : k * step, digits);
      if (axis == 0) {
        canvas.line({p.x(), panel.top_left.y()}, {p.x(), corner.y()}, kGrid);
        canvas.text({p.x(), corner.y() + 17.0}, number, numbers);
      } else {
        TextStyle style = numbers;
        style.anchor = "end";
        canvas.line({panel.top_left.x(), p.y()}, {corner.x(), p.y()}, kGrid);
        canvas.text({panel.top_left.x() - 7.0, p.y() + 4.0}, number, style);
      }
    }
  }
  canvas.rect(panel.top_left, panel.size, R"(fill="none" stroke="#555555" stroke-width="1")");
  const TextStyle title{.size = 13.0, .anchor = "middle"};
  canvas.text({panel.top_left.x() + 0.5 * panel.size.x(), corner.y() + 37.0}, u_title, title);
  TextStyle upright = title;
  upright.rotate = -90.0;
  canvas.text({panel.top_left.x() - 48.0, panel.top_left.y() + 0.5 * panel.size.y()}, v_title,
              upright);
}

}  // namespace dive::mission
