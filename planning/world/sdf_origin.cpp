#include <cmath>
#include <string>

#include <fmt/format.h>

#include "common/xml.h"
#include "planning/world/sdf.h"
#include "planning/world/sdf_geometry.h"

namespace dive::planning {
namespace {

const XmlElement* coordinates_in(const XmlElement& sdf) {
  const XmlElement* world = sdf.child("world");
  return world == nullptr ? nullptr : world->child("spherical_coordinates");
}

// What the axes of the world are, if they are not east, north and up on WGS 84.
std::string other_axes(const XmlElement& coordinates) {
  const auto text = [&](const char* name, const char* usual) {
    const XmlElement* element = coordinates.child(name);
    return element == nullptr ? std::string(usual) : element->text;
  };
  const std::string surface = text("surface_model", "EARTH_WGS84");
  if (surface != "EARTH_WGS84") return "surface_model " + surface;
  const std::string axes = text("world_frame_orientation", "ENU");
  if (axes != "ENU") return "world_frame_orientation " + axes;
  const std::string heading = text("heading_deg", "0");
  if (parse_number(heading) != 0.0) return "heading_deg " + heading;
  return {};
}

}  // namespace

std::optional<GeoPoint> sdf_origin(const SourceText& source, Diagnostics& diagnostics) {
  const std::optional<XmlDocument> document = parse_xml(source, kSdfLimits, diagnostics);
  const XmlElement* coordinates = document ? coordinates_in(document->root) : nullptr;
  if (coordinates == nullptr) return std::nullopt;
  if (const std::string axes = other_axes(*coordinates); !axes.empty()) {
    diagnostics.warning("MAP-ORIGIN", source, coordinates->span,
                        fmt::format("the map's origin is not used: it has {}", axes),
                        "a map's x is east, its y north, on EARTH_WGS84");
    return std::nullopt;
  }
  const auto degrees = [&](const char* name, double limit) -> std::optional<double> {
    const XmlElement* element = coordinates->child(name);
    const auto value = element == nullptr ? std::nullopt : parse_number(element->text);
    if (value && std::abs(*value) <= limit) return value;
    diagnostics.error(
        "MAP-NUMBER", source, (element == nullptr ? coordinates : element)->span,
        fmt::format("<{}> must be a number from {:g} to {:g} (degrees)", name, -limit, limit));
    return std::nullopt;
  };
  const std::optional<double> latitude = degrees("latitude_deg", 90.0);
  const std::optional<double> longitude = degrees("longitude_deg", 180.0);
  if (!latitude || !longitude) return std::nullopt;
  return GeoPoint{*latitude, *longitude};
}

}  // namespace dive::planning
