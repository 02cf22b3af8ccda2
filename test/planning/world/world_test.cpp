#include "planning/world/world.h"

#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/assert.h"
#include "planning/world/overhead.h"
#include "planning/world/scene.h"
#include "planning/world/world_digest.h"
#include "test/planning/reference.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::arbitrary_double;
using testing::arbitrary_lengths;
using testing::arbitrary_rotation_vector;
using testing::arbitrary_vector;
using testing::box_corners;
using testing::directions;
using testing::draw;
using testing::membership;
using testing::still;

TEST(RobotHull, KeepsTheCornersAndOnlyThem) {
  RobotHull hull{{{"body", box_corners({1.0, 0.5, 0.2})}, {"inner", box_corners({0.5, 0.2, 0.1})}}};
  EXPECT_EQ(hull.hull_vertices().size(), 8U);
  hull.parts[1].vertices.emplace_back(0.0, 0.0, 2.0);
  EXPECT_EQ(hull.hull_vertices().size(), 9U);
  EXPECT_DOUBLE_EQ(hull.radius(), 2.0);
}

TEST(RobotHull, ReachesAsFarAsItsPartsInEveryDirection) {
  const auto compass = directions(200);
  EXPECT_TRUE(rc::check([&] {
    RobotHull hull;
    for (int part = 0; part < 3; ++part) {
      ConvexSolid solid;
      for (int i = 0; i < 12; ++i) solid.vertices.push_back(draw(arbitrary_vector(1.0)));
      hull.parts.push_back(solid);
    }
    const auto reach = [](const std::vector<Vector3d>& points, const Vector3d& n) {
      double most = -1e300;
      for (const Vector3d& p : points) most = std::max(most, n.dot(p));
      return most;
    };
    const auto vertices = hull.hull_vertices();
    for (const Vector3d& n : compass) {
      double most = -1e300;
      for (const ConvexSolid& part : hull.parts) most = std::max(most, reach(part.vertices, n));
      RC_ASSERT(std::abs(reach(vertices, n) - most) < 1e-12);
    }
  }));
}

// Sums over the vertices must be equal in every run, so their order must be.
TEST(RobotHull, GivesItsVerticesInAnOrderThatDependsOnThemAlone) {
  const auto corners = box_corners({1.0, 0.5, 0.2});
  const std::vector<Vector3d> reversed(corners.rbegin(), corners.rend());
  EXPECT_EQ((RobotHull{{{"body", corners}}}.hull_vertices()),
            (RobotHull{{{"body", reversed}}}.hull_vertices()));
}

TEST(RobotHull, WithoutVolumeIsOurMistake) {
  const RobotHull sheet{{{"sheet", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}}};
  EXPECT_THROW((void)sheet.hull_vertices(), AssertionFailure);
}

TEST(Bounds, HoldEveryBoundedObstacleAndNoHalfSpace) {
  World world;
  EXPECT_TRUE(world.bounds().isEmpty());
  world.obstacles.push_back({"ground", HalfSpace{Vector3d::UnitZ()}, still({0, 0, -9})});
  EXPECT_TRUE(world.bounds().isEmpty());
  world.obstacles.push_back({"ball", Sphere{1.0}, still({5, 0, -4})});
  world.obstacles.push_back({"box", Box{{2, 4, 6}}, {{-3, 0, -4}, from_rpy(0, 0, M_PI / 2)}});
  EXPECT_LT((world.bounds().min() - Vector3d(-5, -1, -7)).norm(), 1e-12);
  EXPECT_LT((world.bounds().max() - Vector3d(6, 1, -1)).norm(), 1e-12);
}

bool is_overhead(const World& world, const Vector3d& p_W, double radius) {
  return OverheadIndex(world).is_above(p_W, radius);
}

// Overlap of a box with the tube above p, by sampling the tube on a grid: the smallest membership,
// below 1 inside.
double least_membership_in_tube(const Obstacle& box, const Vector3d& p, double radius) {
  double least = 1e300;
  const Pose X_OW = box.X_WO.inverse();
  for (int ring = 0; ring <= 6; ++ring) {
    for (int spoke = 0; spoke < 24; ++spoke) {
      const double angle = 2.0 * M_PI * spoke / 24.0;
      const Vector3d aside(std::cos(angle), std::sin(angle), 0.0);
      for (int level = 0; level <= 60; ++level) {
        Vector3d at = p + aside * (radius * ring / 6.0);
        at.z() = p.z() * (1.0 - level / 60.0);
        least = std::min(least, membership(box.shape, X_OW * at));
      }
    }
  }
  return least;
}

TEST(Overhead, IsExactForBoxesHoweverTheyAreTurned) {
  int yes = 0;
  int no = 0;
  EXPECT_TRUE(rc::check([&] {
    const Vector3d at = draw(arbitrary_vector(2.5));
    const Vector3d size = draw(arbitrary_lengths());
    const Obstacle box{"box", Box{size}, {at, so3_exp(draw(arbitrary_rotation_vector()))}};
    const Vector3d p(0.0, 0.0, draw(arbitrary_double(-3.0, -0.2)));
    const double radius = draw(arbitrary_double(0.01, 1.0));
    const bool answer = is_overhead(World{{box}}, p, radius);
    const double least = least_membership_in_tube(box, p, radius);
    if (least < 1.0) RC_ASSERT(answer);
    // A tube that misses a slightly larger box misses the box; the grid has gaps of at most 0.3 m.
    const Obstacle larger{"", Box{size + Vector3d::Constant(0.7)}, box.X_WO};
    if (least_membership_in_tube(larger, p, radius) > 1.0) RC_ASSERT(!answer);
    ++(answer ? yes : no);
  }));
  EXPECT_GT(yes, 0);
  EXPECT_GT(no, 0);
}

TEST(Overhead, OfManyIsThatOfAnyOfThem) {
  int yes = 0;
  int no = 0;
  EXPECT_TRUE(rc::check([&] {
    World all;
    for (int i = 0; i < 12; ++i) {
      const Vector3d at = draw(arbitrary_vector(6.0)) - Vector3d(0, 0, 4);
      const Pose X_WO{at, so3_exp(draw(arbitrary_rotation_vector()))};
      if (i % 3 == 0) {
        all.obstacles.push_back({"ball", Sphere{draw(arbitrary_double(0.1, 0.8))}, X_WO});
      } else {
        all.obstacles.push_back({"box", Box{draw(arbitrary_lengths())}, X_WO});
      }
    }
    OverheadIndex overheads(all);
    const Vector3d p(0.0, 0.0, draw(arbitrary_double(-8.0, 0.5)));
    const double radius = draw(arbitrary_double(0.0, 1.0));
    const bool any =
        std::any_of(all.obstacles.begin(), all.obstacles.end(),
                    [&](const Obstacle& one) { return is_overhead(World{{one}}, p, radius); });
    RC_ASSERT(overheads.is_above(p, radius) == any);
    ++(any ? yes : no);
  }));
  EXPECT_GT(yes, 0);
  EXPECT_GT(no, 0);
}

TEST(Overhead, CountsOnlyWhatIsBetweenThePointAndTheSurface) {
  const auto box_at = [](double z) {
    return World{{{"box", Box{{2.0, 2.0, 1.0}}, still({0.0, 0.0, z})}}};
  };
  const Vector3d p(0.0, 0.0, -5.0);
  EXPECT_FALSE(is_overhead(box_at(-5.5), p, 0.5));  // Its top is at the point.
  EXPECT_TRUE(is_overhead(box_at(-5.4), p, 0.5));   // The point is inside.
  EXPECT_TRUE(is_overhead(box_at(-2.0), p, 0.5));
  EXPECT_TRUE(is_overhead(box_at(0.3), p, 0.5));   // Awash.
  EXPECT_FALSE(is_overhead(box_at(0.5), p, 0.5));  // On a pier.
  EXPECT_FALSE(is_overhead(box_at(-2.0), {1.51, 0.0, -5.0}, 0.5));
  EXPECT_TRUE(is_overhead(box_at(-2.0), {1.49, 0.0, -5.0}, 0.5));
  EXPECT_FALSE(is_overhead(box_at(-2.0), {1.36, 1.36, -5.0}, 0.5));  // The corner is 0.509 m away.
  EXPECT_TRUE(is_overhead(box_at(-2.0), {1.35, 1.35, -5.0}, 0.5));   // The corner is 0.495 m away.
  EXPECT_TRUE(is_overhead(box_at(-2.0), p, 0.0));
  EXPECT_FALSE(is_overhead(box_at(-2.0), {0.0, 0.0, 0.1}, 0.5));
}

TEST(Overhead, CoversSlopesAndNeverMissesACurvedShape) {
  const Vector3d slope = Vector3d(1.0, 0.0, 2.0).normalized();
  const World ground{{{"ground", HalfSpace{slope}, still({0, 0, -5})}}};
  EXPECT_FALSE(is_overhead(ground, {0.0, 0.0, -4.0}, 0.5));
  // Uphill of the point the ground reaches into the tube.
  EXPECT_TRUE(is_overhead(ground, {0.0, 0.0, -4.9}, 0.5));
  EXPECT_TRUE(is_overhead(ground, {0.0, 0.0, -5.1}, 0.0));
  const World cliff{{{"cliff", HalfSpace{-slope}, still({0, 0, -1})}}};
  EXPECT_TRUE(is_overhead(cliff, {0.0, 0.0, -4.0}, 0.0));
  const World ball{{{"ball", Sphere{1.0}, still({0, 0, -2})}}};
  EXPECT_TRUE(is_overhead(ball, {1.1, 0.0, -5.0}, 0.2));
  EXPECT_FALSE(is_overhead(ball, {2.0, 0.0, -5.0}, 0.2));
}

TEST(WorldDigest, ChangesWithTheLastBitOfEachShapeAndPose) {
  const World original{{{"box", Box{{1, 2, 3}}, still({0, 0, -5})},
                        {"pipe", Cylinder{0.2, 4.0}, still({1, 0, -5})},
                        {"ball", Sphere{0.5}, still({2, 0, -5})},
                        {"rod", Capsule{0.2, 4.0}, still({3, 0, -5})},
                        {"egg", Ellipsoid{{1, 2, 3}}, still({4, 0, -5})},
                        {"ground", HalfSpace{{0, 0, 1}}, still({0, 0, -9})},
                        {"piece", Polytope{{{0, 0, 0}, {1, 0, 0}}, 0.1}, still({5, 0, -5})}}};
  const std::uint64_t digest = world_digest(original);
  EXPECT_EQ(world_digest(World(original)), digest);
  EXPECT_NE(world_digest({}), 0U);
  const auto changes = [&](std::size_t index, auto&& change) {
    World world = original;
    change(world.obstacles.at(index));
    return world_digest(world) != digest;
  };
  const auto bump = [](double& value) { value = std::nextafter(value, 100.0); };
  for (std::size_t i = 0; i < original.obstacles.size(); ++i) {
    EXPECT_TRUE(changes(i, [&](Obstacle& one) { bump(one.X_WO.p.x()); })) << i;
    EXPECT_TRUE(changes(i, [&](Obstacle& one) { bump(one.X_WO.q.z()); })) << i;
    EXPECT_TRUE(changes(i, [&](Obstacle& one) { one.name += "2"; })) << i;
  }
  EXPECT_TRUE(changes(0, [&](Obstacle& one) { bump(std::get<Box>(one.shape).size.z()); }));
  EXPECT_TRUE(changes(1, [&](Obstacle& one) { bump(std::get<Cylinder>(one.shape).length); }));
  EXPECT_TRUE(changes(2, [&](Obstacle& one) { bump(std::get<Sphere>(one.shape).radius); }));
  EXPECT_TRUE(changes(3, [&](Obstacle& one) { bump(std::get<Capsule>(one.shape).radius); }));
  EXPECT_TRUE(changes(4, [&](Obstacle& one) { bump(std::get<Ellipsoid>(one.shape).radii.y()); }));
  EXPECT_TRUE(changes(5, [&](Obstacle& one) { bump(std::get<HalfSpace>(one.shape).normal.x()); }));
  EXPECT_TRUE(
      changes(6, [&](Obstacle& one) { bump(std::get<Polytope>(one.shape).vertices[1].y()); }));
  EXPECT_TRUE(changes(6, [&](Obstacle& one) { bump(std::get<Polytope>(one.shape).radius); }));
}

}  // namespace
}  // namespace dive::planning
