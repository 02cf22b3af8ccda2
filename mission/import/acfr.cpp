#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/se3.h"
#include "common/suggest.h"
#include "common/xml.h"
#include "mission/import/foreign_mission.h"

namespace dive::mission {
namespace {

constexpr XmlLimits kLimits{};
constexpr std::size_t kMaxPoints = 1000;  // of all legs: what one of our missions may have
constexpr std::array<std::string_view, 3> kKnown = {"goto", "leg", "zambonie"};
constexpr std::array<std::string_view, 5> kRead = {"goto", "leg", "zambonie", "inwardspiral",
                                                   "command"};

using Eigen::Vector2d;

/// North and east as ACFR writes them, in our x east and y north.
Vector2d in_world(double x_north, double y_east) { return {y_east, x_north}; }

class Reader {
 public:
  Reader(const SourceText& source, Diagnostics& diagnostics)
      : source_(source), diagnostics_(diagnostics) {}

  std::optional<ForeignMission> read(const XmlElement& root) {
    if (root.name != "mission") {
      error(root.span, fmt::format("this is not a mission of ACFR's: the root is '{}'", root.name));
      return std::nullopt;
    }
    ForeignMission mission;
    if (const XmlElement* desc = root.child("desc")) mission.description = squeezed(desc->text);
    if (const XmlElement* global = root.child("global")) {
      if (const XmlElement* drop = global->child("drop_distance")) {
        drop_m_ = number(*drop, {"m"}).value_or(drop_m_);
      }
    }
    for (const XmlElement& primitive : root.children) {
      if (primitive.name != "primitive") continue;
      for (const XmlElement& element : primitive.children) add(element, mission);
    }
    if (is_broken_) return std::nullopt;
    std::size_t points = 0;
    for (const ForeignLeg& leg : mission.legs) points += leg.points.size();
    if (mission.legs.empty()) {
      error(root.span, "the mission has no primitive that can be swum");
    } else if (points > kMaxPoints) {
      error(root.span,
            fmt::format("the mission has {} waypoints, more than {}", points, kMaxPoints));
    }
    if (is_broken_) return std::nullopt;
    return mission;
  }

 private:
  static std::string squeezed(const std::string& text) {
    std::string result;
    for (const char c : text) {
      const bool blank = c == ' ' || c == '\n' || c == '\t' || c == '\r';
      if (!blank) result += c;
      if (blank && !result.empty() && result.back() != ' ') result += ' ';
    }
    if (!result.empty() && result.back() == ' ') result.pop_back();
    return result;
  }

  void error(Span span, std::string message, std::string hint = {}) {
    is_broken_ = true;
    diagnostics_.error("IMP-ACFR", source_, span, std::move(message), std::move(hint));
  }

  std::optional<double> number(const XmlElement& element,
                               std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names) {
      const XmlAttribute* attribute = element.attribute(name);
      if (attribute == nullptr) continue;
      const std::optional<double> value = parse_number(attribute->value);
      if (value && std::isfinite(*value)) return value;
      error(attribute->value_span, fmt::format("'{}' is not a number", attribute->value));
      return std::nullopt;
    }
    error(element.span, fmt::format("'{}' lacks the attribute '{}'", element.name, *names.begin()));
    return std::nullopt;
  }

  /// Of a part of the primitive that must be there.
  std::optional<double> part(const XmlElement& primitive, std::string_view name,
                             std::initializer_list<std::string_view> attributes) {
    const XmlElement* child = primitive.child(name);
    if (child != nullptr) return number(*child, attributes);
    error(primitive.span, fmt::format("'{}' lacks a '{}'", primitive.name, name));
    return std::nullopt;
  }

  void add(const XmlElement& element, ForeignMission& mission) {
    if (std::ranges::find(kRead, element.name) == kRead.end()) {
      const std::vector<std::string> names(kRead.begin(), kRead.end());
      return error(element.span, fmt::format("the primitive '{}' is not known", element.name),
                   did_you_mean(element.name, names));
    }
    if (std::ranges::find(kKnown, element.name) == kKnown.end()) {
      diagnostics_.warning(
          "IMP-PRIMITIVE", source_, element.span,
          fmt::format("'{}' is none of goto, leg and zambonie: their own software drops it",
                      element.name),
          "it is imported as what it says");
    }
    if (element.name == "command") {
      for (const XmlElement& command : element.children) keep_command(command);
      return;
    }
    ForeignLeg leg;
    leg.span = element.span;
    leg.capture_radius = std::clamp(drop_m_, 0.05, 20.0);
    leg.timeout_s = part(element, "timeout", {"t"}).value_or(0.0);
    leg.speed = part(element, "velocity", {"x"}).value_or(0.0);
    read_depth_mode(element, leg);
    for (const XmlElement& child : element.children) {
      if (child.name == "command") keep_command(child);
    }
    leg.payload = std::exchange(commands_, {});
    if (read_points(element, leg) && !leg.points.empty()) mission.legs.push_back(std::move(leg));
  }

  void keep_command(const XmlElement& element) {
    const XmlAttribute* device = element.attribute("device");
    const XmlAttribute* state = element.attribute("onoff");
    if (device == nullptr || state == nullptr) {
      return error(element.span, "a command needs a device and an onoff");
    }
    commands_.push_back(as_id(fmt::format("{}_{}", device->value, state->value)));
  }

  void read_depth_mode(const XmlElement& element, ForeignLeg& leg) {
    const XmlElement* depth = element.child("depth");
    const XmlAttribute* mode = depth == nullptr ? nullptr : depth->attribute("mode");
    if (mode == nullptr) {
      diagnostics_.warning(
          "IMP-MODE", source_, element.span,
          fmt::format("'{}' does not say whether its z is a depth or an altitude", element.name),
          "taken as a depth");
      return;
    }
    leg.is_altitude = mode->value == "altitude";
    if (leg.is_altitude || mode->value == "depth") return;
    const std::optional<std::string> meant =
        closest_match(mode->value, std::vector<std::string>{"depth", "altitude"});
    error(mode->value_span, fmt::format("'{}' is no depth mode", mode->value),
          meant ? fmt::format("did you mean '{}'?", *meant) : "there are depth and altitude");
  }

  bool read_points(const XmlElement& element, ForeignLeg& leg) {
    const auto x = part(element, "position", {"x"});
    const auto y = part(element, "position", {"y"});
    const auto z = part(element, "position", {"z"});
    if (!x || !y || !z) return false;
    leg.z = std::max(*z, 0.0);
    const Vector2d begin = in_world(*x, *y);
    leg.points = {begin};
    if (element.name == "goto") return true;
    const auto heading = element.child("rotation") != nullptr && element.child("heading") == nullptr
                             ? part(element, "rotation", {"deg", "r"})
                             : part(element, "heading", {"deg"});
    const auto length = part(element, "length", {"m", "l"});
    if (!heading || !length) return false;
    const double h = deg_to_rad(*heading);
    const Vector2d along = in_world(std::cos(h), std::sin(h));
    if (element.name == "leg") {
      leg.points.push_back(begin + *length * along);
      return true;
    }
    const auto width = part(element, "width", {"m", "w"});
    const auto spacing = part(element, "spacing", {"m", "s"});
    if (!width || !spacing) return false;
    if (*spacing < 0.05 || *length < 0.0 || *width < 0.0 ||
        *width / *spacing > static_cast<double>(kMaxPoints)) {
      error(element.span,
            fmt::format("{:g} m of width cannot be mown every {:g} m", *width, *spacing));
      return false;
    }
    const XmlElement* direction = element.child("direction");
    const XmlAttribute* turn = direction == nullptr ? nullptr : direction->attribute("d");
    const double side = turn != nullptr && turn->value == "ccw" ? -1.0 : 1.0;
    const Vector2d across = side * in_world(-std::sin(h), std::cos(h));  // to starboard for cw
    leg.points = element.name == "zambonie"
                     ? mown(begin, along, across, *length, *width, *spacing)
                     : spiral(begin, along, across, *length, *width, *spacing);
    return true;
  }

  static std::vector<Vector2d> mown(const Vector2d& begin, const Vector2d& along,
                                    const Vector2d& across, double length, double width,
                                    double spacing) {
    std::vector<Vector2d> points;
    const int rows = static_cast<int>(width / spacing) + 1;
    for (int row = 0; row < rows; ++row) {
      const Vector2d near = begin + row * spacing * across;
      const Vector2d far = near + length * along;
      points.push_back(row % 2 == 0 ? near : far);
      points.push_back(row % 2 == 0 ? far : near);
    }
    return points;
  }

  // Round the rectangle's edge, and again one spacing further in, until there is no room.
  static std::vector<Vector2d> spiral(const Vector2d& begin, const Vector2d& along,
                                      const Vector2d& across, double length, double width,
                                      double spacing) {
    std::vector<Vector2d> points;
    const auto at = [&](double l, double w) { return Vector2d(begin + l * along + w * across); };
    for (double in = 0.0; 2.0 * in <= std::min(length, width); in += spacing) {
      points.push_back(at(in > 0.0 ? in - spacing : 0.0, in));
      points.push_back(at(length - in, in));
      points.push_back(at(length - in, width - in));
      points.push_back(at(in, width - in));
    }
    return points;
  }

  const SourceText& source_;
  Diagnostics& diagnostics_;
  double drop_m_ = 0.5;
  std::vector<std::string> commands_;
  bool is_broken_ = false;
};

}  // namespace

std::optional<ForeignMission> read_acfr(const std::string& path, Diagnostics& diagnostics,
                                        SourceText& source) {
  std::optional<XmlDocument> document = read_xml(path, kLimits, diagnostics);
  if (!document) return std::nullopt;
  source = std::move(document->source);
  return Reader(source, diagnostics).read(document->root);
}

}  // namespace dive::mission
