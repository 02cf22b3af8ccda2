#include "mission/states/transect.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/se3.h"
#include "mission/document/state_reader.h"
#include "mission/states/goal_sequence.h"

namespace dive::mission {
namespace {

constexpr double kGroundStep = 5.0;  // m between the goals of a row that follows the ground

using Eigen::Vector2d;

struct Line {
  Vector2d from;
  Vector2d to;
  Span span;
};

Vector2d point(const AttributeReader& attributes, const XmlElement& element, const char* x,
               const char* y) {
  return {attributes.number(element, x).value, attributes.number(element, y).value};
}

// Every second row is swum in the opposite direction.
void add_rows(const AttributeReader& attributes, const XmlElement& rows, std::vector<Line>& lines) {
  const double yaw = heading_to_yaw(attributes.number(rows, "heading_deg").value);
  const Vector2d along(std::cos(yaw), std::sin(yaw));
  const bool to_the_left = attributes.name(rows, "side").value == "left";
  const Vector2d left(-along.y(), along.x());
  const Vector2d across = (to_the_left ? 1.0 : -1.0) * left;
  const Vector2d begin = point(attributes, rows, "x", "y");
  const double length = attributes.number(rows, "length").value;
  const double spacing = attributes.number(rows, "spacing").value;
  const int count = static_cast<int>(attributes.number(rows, "count").value);
  for (int row = 0; row < count; ++row) {
    const Vector2d near = begin + row * spacing * across;
    const Vector2d far = near + length * along;
    lines.push_back(row % 2 == 0 ? Line{near, far, rows.span} : Line{far, near, rows.span});
  }
}

std::vector<Line> lines_of(const AttributeReader& attributes, const XmlElement& transect) {
  std::vector<Line> lines;
  for (const XmlElement& child : transect.children) {
    if (child.name == "leg") {
      lines.push_back({point(attributes, child, "from_x", "from_y"),
                       point(attributes, child, "to_x", "to_y"), child.span});
    } else if (child.name == "rows") {
      add_rows(attributes, child, lines);
    }
  }
  return lines;
}

}  // namespace

// A row at an altitude is divided so that it follows the ground; at a depth its ends suffice.
void read_transect(const XmlElement& element, const StateReader& reader, StateSpec& spec) {
  const AttributeReader& attributes = reader.attributes();
  const Located<double> z = attributes.number(element, "z");
  const ZUnits units = attributes.z_units(element);
  std::vector<Goal> goals;
  const auto add = [&](const Vector2d& p, Span span) {
    Goal goal;
    goal.id = {fmt::format("{}-{}", spec.id.value, goals.size() + 1), span};
    goal.position = {{p.x(), span}, {p.y(), span}, z, units};
    goal.capture_radius = attributes.number(element, "capture_radius");
    goal.dwell_s = {0.0, span};
    goal.reduced_clearance = attributes.optional_number(element, "reduced_clearance");
    goal.span = span;
    goals.push_back(std::move(goal));
  };
  for (const Line& line : lines_of(attributes, element)) {
    const double length = (line.to - line.from).norm();
    const int pieces =
        units == ZUnits::kAltitude ? std::max(1, static_cast<int>(length / kGroundStep)) : 1;
    for (int i = 0; i <= pieces; ++i) {
      add(line.from + static_cast<double>(i) / pieces * (line.to - line.from), line.span);
    }
  }
  spec.atomic = std::make_shared<GoalSequenceState>(std::move(goals));
}

}  // namespace dive::mission
