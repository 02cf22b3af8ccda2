#include "common/geodesy.h"

#include <GeographicLib/LocalCartesian.hpp>

#include "common/assert.h"

namespace dive {
namespace {

// The height of the ellipsoid above the plane changes by less than a micrometre in the last round.
constexpr int kRounds = 4;

GeographicLib::LocalCartesian frame_at(const GeoPoint& origin) {
  return {origin.latitude_deg, origin.longitude_deg, 0.0, GeographicLib::Geocentric::WGS84()};
}

}  // namespace

std::optional<Eigen::Vector2d> to_plane(const GeoPoint& origin, const GeoPoint& point) {
  Eigen::Vector3d p;
  frame_at(origin).Forward(point.latitude_deg, point.longitude_deg, 0.0, p.x(), p.y(), p.z());
  // In space: the antipode is near the origin in the plane.
  if (!(p.norm() <= kMaxOriginDistance)) return std::nullopt;
  return p.head<2>();
}

GeoPoint to_geographic(const GeoPoint& origin, const Eigen::Vector2d& p) {
  DIVE_DEMAND(p.norm() <= 2.0 * kMaxOriginDistance);
  const GeographicLib::LocalCartesian frame = frame_at(origin);
  GeoPoint point;
  double z = 0.0;  // of the ellipsoid over the plane
  for (int round = 0; round < kRounds; ++round) {
    double height = 0.0;
    frame.Reverse(p.x(), p.y(), z, point.latitude_deg, point.longitude_deg, height);
    z -= height;
  }
  return point;
}

}  // namespace dive
