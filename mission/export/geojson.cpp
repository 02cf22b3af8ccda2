#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "mission/export/export_format.h"
#include "mission/export/mesh_lines.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;

// 1e-9 degrees are 0.1 mm.
double rounded(double value, double scale) { return std::round(value * scale) / scale; }

Json position(const GeoPoint& origin, const Eigen::Vector3d& p_W) {
  const GeoPoint point = to_geographic(origin, p_W.head<2>());
  return {rounded(point.longitude_deg, 1e9), rounded(point.latitude_deg, 1e9),
          rounded(p_W.z(), 1e4)};
}

Json feature(const char* type, Json coordinates, Json properties) {
  return {{"type", "Feature"},
          {"geometry", {{"type", type}, {"coordinates", std::move(coordinates)}}},
          {"properties", std::move(properties)}};
}

}  // namespace

std::string to_geojson(const Exported& exported) {
  const GeoPoint& origin = *exported.origin;
  Json features = Json::array();
  for (const ExportedPlace& place : exported.places) {
    features.push_back(
        feature("Point", position(origin, place.p_W),
                {{"kind", place.kind}, {"name", place.name}, {"depth_m", -place.p_W.z()}}));
  }
  for (const ColouredLine& line : lines_of(exported)) {
    Json points = Json::array();
    for (const Eigen::Vector3d& p : line.points_W) points.push_back(position(origin, p));
    features.push_back(feature("LineString", std::move(points), {{"name", line.name}}));
  }
  if (!exported.fence.empty()) {
    Json ring = Json::array();
    double twice_area = 0.0;
    for (std::size_t i = 0; i <= exported.fence.size(); ++i) {
      const Eigen::Vector2d& p = exported.fence[i % exported.fence.size()];
      const Eigen::Vector2d& next = exported.fence[(i + 1) % exported.fence.size()];
      if (i < exported.fence.size()) twice_area += p.x() * next.y() - p.y() * next.x();
      ring.push_back(position(origin, {p.x(), p.y(), 0.0}));
    }
    // The outer ring of a polygon is counter-clockwise.
    if (twice_area < 0.0) std::reverse(ring.begin(), ring.end());
    features.push_back(feature("Polygon", Json::array({std::move(ring)}), {{"name", "geofence"}}));
  }
  const Json json = {
      {"type", "FeatureCollection"}, {"name", exported.name}, {"features", std::move(features)}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace dive::mission
