// The tangent plane, against closed formulae of the ellipsoid that share nothing with
// GeographicLib.

#include "common/geodesy.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace dive {
namespace {

constexpr double kSemiMajor = 6378137.0;
constexpr double kFlattening = 1.0 / 298.257223563;
constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

// Earth-centred coordinates of a point on the ellipsoid, by the prime vertical's radius.
Eigen::Vector3d earth_centred(const GeoPoint& point) {
  const double phi = radians(point.latitude_deg);
  const double lambda = radians(point.longitude_deg);
  const double n = kSemiMajor / std::sqrt(1.0 - kEccentricity2 * std::sin(phi) * std::sin(phi));
  return {n * std::cos(phi) * std::cos(lambda), n * std::cos(phi) * std::sin(lambda),
          n * (1.0 - kEccentricity2) * std::sin(phi)};
}

Eigen::Vector2d east_and_north(const GeoPoint& origin, const GeoPoint& point) {
  const Eigen::Vector3d d = earth_centred(point) - earth_centred(origin);
  const double phi = radians(origin.latitude_deg);
  const double lambda = radians(origin.longitude_deg);
  const Eigen::Vector3d east(-std::sin(lambda), std::cos(lambda), 0.0);
  const Eigen::Vector3d north(-std::sin(phi) * std::cos(lambda), -std::sin(phi) * std::sin(lambda),
                              std::cos(phi));
  return {east.dot(d), north.dot(d)};
}

GeoPoint any_point(double latitude_limit) {
  const auto degrees = [](double limit) {
    return *rc::gen::inRange(-1'000'000, 1'000'001) * 1e-6 * limit;
  };
  const double latitude = degrees(latitude_limit);
  return {latitude, degrees(180.0)};
}

Eigen::Vector2d any_place() {
  const auto metres = [] { return *rc::gen::inRange(-5'000'000, 5'000'001) * 1e-3; };
  const double x = metres();
  return {x, metres()};
}

RC_GTEST_PROP(Geodesy, AgreesWithClosedFormulaeWithinAMillimetreOver5Km, ()) {
  const GeoPoint origin = any_point(89.9);
  const GeoPoint point = to_geographic(origin, any_place());
  const auto p = to_plane(origin, point);
  RC_ASSERT(p.has_value());
  RC_ASSERT((*p - east_and_north(origin, point)).norm() < 1e-5);
}

RC_GTEST_PROP(Geodesy, ToTheEarthAndBackIsTheSamePlace, ()) {
  const GeoPoint origin = any_point(89.9);
  const Eigen::Vector2d place = any_place();
  const auto p = to_plane(origin, to_geographic(origin, place));
  RC_ASSERT(p.has_value());
  RC_ASSERT((*p - place).norm() < 1e-6);
}

TEST(Geodesy, KnowsWhereEastAndNorthAre) {
  // Computed with the formulae above, in another language.
  const auto halifax = to_plane({44.65, -63.57}, {44.66, -63.56});
  ASSERT_TRUE(halifax);
  EXPECT_NEAR(halifax->x(), 793.117497, 1e-5);
  EXPECT_NEAR(halifax->y(), 1111.298994, 1e-5);
  const auto sydney = to_plane({-33.839459, 151.25438}, {-33.80, 151.29});
  ASSERT_TRUE(sydney);
  EXPECT_NEAR(sydney->x(), 3298.438040, 1e-5);
  EXPECT_NEAR(sydney->y(), 4376.186813, 1e-5);
}

TEST(Geodesy, CrossesTheDateLine) {
  const auto p = to_plane({0.0, 179.999}, {0.0, -179.999});
  ASSERT_TRUE(p);
  EXPECT_NEAR(p->x(), kSemiMajor * std::sin(radians(0.002)), 1e-6);
  EXPECT_NEAR(p->y(), 0.0, 1e-6);
}

TEST(Geodesy, HasNoPlaceFarFromTheOriginNorOffTheEarth) {
  EXPECT_FALSE(to_plane({44.65, -63.57}, {44.65, 63.57})) << "a sign forgotten";
  EXPECT_FALSE(to_plane({44.65, -63.57}, {-44.65, 116.43})) << "the antipode";
  EXPECT_FALSE(to_plane({0.0, 0.0}, {91.0, 0.0}));
}

}  // namespace
}  // namespace dive
