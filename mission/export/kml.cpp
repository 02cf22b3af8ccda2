#include <fmt/format.h>

#include "common/xml.h"
#include "mission/export/export_format.h"
#include "mission/export/mesh_lines.h"

namespace dive::mission {
namespace {

std::string coordinates(const GeoPoint& origin, const Eigen::Vector3d& p_W) {
  const GeoPoint point = to_geographic(origin, p_W.head<2>());
  return fmt::format("{:.9f},{:.9f},{:.4f}", point.longitude_deg, point.latitude_deg, p_W.z());
}

std::string placemark(const std::string& name, const std::string& description,
                      const std::string& style, const std::string& geometry) {
  return fmt::format(
      "    <Placemark>\n      <name>{}</name>\n{}{}      {}\n    </Placemark>\n", escape_xml(name),
      description.empty()
          ? ""
          : fmt::format("      <description>{}</description>\n", escape_xml(description)),
      style, geometry);
}

// KML's colours are alpha, blue, green, red.
std::string line_style(const Colour& colour) {
  return fmt::format(
      "      "
      "<Style><LineStyle><color>ff{:02x}{:02x}{:02x}</color><width>2</width></LineStyle></Style>\n",
      colour[2], colour[1], colour[0]);
}

std::string fence_of(const Exported& exported) {
  std::string ring;
  for (std::size_t i = 0; i <= exported.fence.size(); ++i) {
    const Eigen::Vector2d& p = exported.fence[i % exported.fence.size()];
    ring += coordinates(*exported.origin, {p.x(), p.y(), 0.0}) + " ";
  }
  return placemark("geofence", "", "",
                   "<Polygon><outerBoundaryIs><LinearRing><coordinates>" + ring +
                       "</coordinates></LinearRing></outerBoundaryIs></Polygon>");
}

}  // namespace

std::string to_kml(const Exported& exported) {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\">\n"
      "  <Document>\n    <name>{}</name>\n",
      escape_xml(exported.name));
  for (const ExportedPlace& place : exported.places) {
    text += placemark(place.name, fmt::format("{}, {:.1f} m deep", place.kind, -place.p_W.z()), "",
                      "<Point><altitudeMode>absolute</altitudeMode><coordinates>" +
                          coordinates(*exported.origin, place.p_W) + "</coordinates></Point>");
  }
  for (const ColouredLine& line : lines_of(exported)) {
    std::string points;
    for (const Eigen::Vector3d& p : line.points_W) points += coordinates(*exported.origin, p) + " ";
    text += placemark(line.name, "", line_style(line.colour),
                      "<LineString><altitudeMode>absolute</altitudeMode><coordinates>" + points +
                          "</coordinates></LineString>");
  }
  if (!exported.fence.empty()) text += fence_of(exported);
  return text + "  </Document>\n</kml>\n";
}

}  // namespace dive::mission
