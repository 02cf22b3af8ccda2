#pragma once
// Geographic positions: W as the tangent plane of the WGS 84 ellipsoid at an origin, by
// GeographicLib. doc/decisions/tangent-plane.md.

#include <optional>

#include <Eigen/Core>

namespace dive {

/// A point on the WGS 84 ellipsoid; degrees, north and east positive.
struct GeoPoint {
  double latitude_deg = 0.0;   ///< -90 to 90.
  double longitude_deg = 0.0;  ///< -180 to 180.
};

/// Distance (m) from an origin within which positions are converted: a plane is exact enough there,
/// and what is farther away is a typing error.
inline constexpr double kMaxOriginDistance = 20'000.0;

/// x east, y north (m) of the point on the ellipsoid (height 0) in the plane that touches it at
/// `origin`: the first two components of R (X - X_0), X earth-centred. Empty farther than
/// kMaxOriginDistance from the origin.
[[nodiscard]] std::optional<Eigen::Vector2d> to_plane(const GeoPoint& origin,
                                                      const GeoPoint& point);

/// Inverse of to_plane(), exact to 1e-6 m. Requires p.norm() <= 2 kMaxOriginDistance.
[[nodiscard]] GeoPoint to_geographic(const GeoPoint& origin, const Eigen::Vector2d& p);

}  // namespace dive
