#include "mission/import/acfr_points.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "common/se3.h"
#include "mission/import/acfr_patterns.h"

namespace dive::mission {
namespace {

using Eigen::Vector2d;

/// North and east as ACFR writes them, in our x east and y north.
Vector2d in_world(double x_north, double y_east) { return {y_east, x_north}; }

bool is_counterclockwise(AcfrElements& elements, const XmlElement& element) {
  const XmlElement* direction = elements.account().child(element, "direction");
  const XmlAttribute* turn =
      direction == nullptr ? nullptr : elements.account().attribute(*direction, "d");
  if (turn == nullptr) return false;
  const std::string word = lower_case(turn->value);
  if (word == "cw" || word == "ccw") return word == "ccw";
  elements.error(turn->value_span,
                 fmt::format("'{}' is no direction: there are cw and ccw", turn->value));
  return false;
}

// `area` lacks the pattern-specific values, and its `across` is to starboard.
bool cover(AcfrElements& elements, const XmlElement& element, CoveredArea area, ForeignLeg& leg) {
  const auto width = elements.part(element, "width", {"m", "w"});
  const bool has_offset = element.child("spacing") == nullptr && element.child("offset") != nullptr;
  const auto spacing = elements.part(element, has_offset ? "offset" : "spacing", {"m", "s"});
  if (!width || !spacing) return false;
  if (*spacing < 0.05 || area.length < 0.0 || *width < 0.0 ||
      *width / *spacing > static_cast<double>(kMaxAcfrPoints)) {
    elements.error(element.span,
                   fmt::format("{:g} m of width cannot be covered every {:g} m", *width, *spacing));
    return false;
  }
  area.width = *width;
  area.spacing = *spacing;
  if (is_counterclockwise(elements, element)) area.across *= -1.0;
  const bool rows = element.name == "zambonie";
  leg.points = rows ? rows_over(area) : spiral_over(area);
  elements.report().warning(
      "IMP-PATTERN", element.span,
      rows ? fmt::format("'zambonie' is swum as {} rows back and forth, one after the other; "
                         "ACFR's vehicles swim loops, so that rows beside each other are far "
                         "apart in time",
                         leg.points.size() / 2)
           : fmt::format("'{}' is swum with square corners", element.name));
  return true;
}

}  // namespace

bool read_points(AcfrElements& elements, const XmlElement& element, ForeignLeg& leg) {
  const auto x = elements.part(element, "position", {"x"});
  const auto y = elements.part(element, "position", {"y"});
  const auto z = elements.part(element, "position", {"z"});
  if (!x || !y || !z) return false;
  leg.z = std::max(*z, 0.0);
  if (*z < 0.0) {
    elements.report().warning("IMP-CHANGED", element.child("position")->span,
                              fmt::format("'position' z=\"{:g}\" is {}: it becomes 0", *z,
                                          leg.is_altitude ? "in the ground" : "above the surface"));
  }
  const Vector2d begin = in_world(*x, *y);
  leg.points = {begin};
  const auto heading = elements.heading_of(element);
  if (element.name == "goto") {
    if (heading) leg.heading_deg = *heading - 360.0 * std::floor(*heading / 360.0);
    return true;
  }
  if (!heading) {
    elements.error(element.span, fmt::format("'{}' lacks a 'heading'", element.name));
    return false;
  }
  const auto length = elements.part(element, "length", {"m", "l"});
  if (!length) return false;
  const double h = deg_to_rad(*heading);
  const Vector2d along = in_world(std::cos(h), std::sin(h));
  if (element.name == "leg") {
    leg.points.push_back(begin + *length * along);
    return true;
  }
  return cover(elements, element, {begin, along, in_world(-std::sin(h), std::cos(h)), *length},
               leg);
}

}  // namespace dive::mission
