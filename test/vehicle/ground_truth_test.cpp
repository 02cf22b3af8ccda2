#include "vehicle/simulator/ground_truth/ground_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/random.h"
#include "test/common/arbitrary.h"
#include "vehicle/model.h"

namespace dive::vehicle {
namespace {

using ::dive::testing::arbitrary_double;
using ::dive::testing::arbitrary_rotation_vector;
using ::dive::testing::arbitrary_vector;
using planning::Box;
using planning::RobotHull;
using planning::World;

planning::ConvexSolid box_solid(const Eigen::Vector3d& centre, const Eigen::Vector3d& size) {
  planning::ConvexSolid solid{"box", {}};
  for (int i = 0; i < 8; ++i) {
    solid.vertices.push_back(centre +
                             0.5 * size.cwiseProduct(Eigen::Vector3d((i & 1) != 0 ? 1.0 : -1.0,
                                                                     (i & 2) != 0 ? 1.0 : -1.0,
                                                                     (i & 4) != 0 ? 1.0 : -1.0)));
  }
  return solid;
}

RobotHull box_hull(const Eigen::Vector3d& size) {
  return {{box_solid(Eigen::Vector3d::Zero(), size)}};
}

World world_of(planning::Shape shape, const Pose& X_WO = {}) {
  return {{{"obstacle", std::move(shape), X_WO}}};
}

Pose at(double x, double y, double z) {
  return {Eigen::Vector3d(x, y, z), Eigen::Quaterniond::Identity()};
}

// Nearest point of a box to a point, in closed form.
Eigen::Vector3d nearest_in_box(const Eigen::Vector3d& size, const Pose& X_WO,
                               const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d p = X_WO.inverse() * p_W;
  return X_WO * p.cwiseMax(-0.5 * size).cwiseMin(0.5 * size).eval();
}

// Distance of two boxes by alternating projections (Cheney and Goldstein, 1959): slow, and
// independent of the code under test. Never below the truth.
double distance_by_projections(const Eigen::Vector3d& size_a, const Pose& X_WA,
                               const Eigen::Vector3d& size_b, const Pose& X_WB) {
  Eigen::Vector3d on_a = X_WA.p;
  Eigen::Vector3d on_b = X_WB.p;
  for (int i = 0; i < 20'000; ++i) {
    on_b = nearest_in_box(size_b, X_WB, on_a);
    const Eigen::Vector3d next = nearest_in_box(size_a, X_WA, on_b);
    if ((next - on_a).norm() < 1e-13) break;
    on_a = next;
  }
  return (on_a - on_b).norm();
}

TEST(ClearanceMeter, AgreesWithAlternatingProjectionsBetweenBoxes) {
  EXPECT_TRUE(rc::check([] {
    const Eigen::Vector3d hull_size = *arbitrary_vector(0.7) + Eigen::Vector3d::Constant(0.75);
    const Eigen::Vector3d wall_size = *arbitrary_vector(2.0) + Eigen::Vector3d::Constant(2.05);
    const Pose X_WO{*arbitrary_vector(3.0), so3_exp(*arbitrary_rotation_vector())};
    const Pose X_WB{*arbitrary_vector(5.0), so3_exp(*arbitrary_rotation_vector())};
    const ClearanceMeter meter(world_of(Box{wall_size}, X_WO), box_hull(hull_size));
    const double expected = distance_by_projections(hull_size, X_WB, wall_size, X_WO);
    const double measured = meter.clearance(X_WB);
    RC_ASSERT(measured <= expected + 1e-9);
    RC_ASSERT(measured >= expected - 2e-3);
  }));
}

// Parallel faces and edges, the most degenerate case of distances between triangles.
TEST(ClearanceMeter, MeasuresAxisAlignedBoxesExactly) {
  EXPECT_TRUE(rc::check([] {
    const Eigen::Vector3d hull_size(1.0, 0.5, 0.25);
    const Eigen::Vector3d wall_size(2.0, 0.5, 1.0);
    const Eigen::Vector3d p =
        Eigen::Vector3i(*rc::gen::inRange(-12, 13), *rc::gen::inRange(-12, 13),
                        *rc::gen::inRange(-12, 13))
            .cast<double>() /
        4.0;
    const double quarter_turn = deg_to_rad(90.0) * *rc::gen::inRange(0, 4);
    const bool crosswise = std::abs(std::sin(quarter_turn)) > 0.5;
    const Eigen::Vector3d size =
        crosswise ? Eigen::Vector3d(hull_size.y(), hull_size.x(), hull_size.z()) : hull_size;
    const Eigen::Vector3d gap = (p.cwiseAbs() - 0.5 * (size + wall_size)).cwiseMax(0.0);
    const ClearanceMeter meter(world_of(Box{wall_size}), box_hull(hull_size));
    const double measured = meter.clearance({p, from_rpy(0.0, 0.0, quarter_turn)});
    RC_ASSERT(std::abs(measured - gap.norm()) < 1e-7);
  }));
}

// Closed-form distances from a point to the curved shapes. The hull is a tiny body at the point.
struct SpeckCase {
  const char* name;
  planning::Shape shape;
  double largest_radius;
  double (*distance)(const Eigen::Vector3d& p);
};

class CurvedShapes : public ::testing::TestWithParam<SpeckCase> {};

TEST_P(CurvedShapes, AreNeverFartherThanTheyAreAndHardlyNearer) {
  const SpeckCase& test = GetParam();
  constexpr double kSpeck = 1e-4;
  EXPECT_TRUE(rc::check([&] {
    const Pose X_WO{*arbitrary_vector(2.0), so3_exp(*arbitrary_rotation_vector())};
    const Eigen::Vector3d p_W = *arbitrary_vector(4.0);
    const ClearanceMeter meter(world_of(test.shape, X_WO),
                               box_hull(Eigen::Vector3d::Constant(kSpeck)));
    const double truth = std::max(0.0, test.distance(X_WO.inverse() * p_W));
    const double measured = meter.clearance({p_W, Eigen::Quaterniond::Identity()});
    RC_ASSERT(measured <= truth);
    RC_ASSERT(measured >= truth - kSpeck - 0.005 * test.largest_radius);
  }));
}

double to_cylinder(const Eigen::Vector3d& p) {
  const double outside = std::max(0.0, std::hypot(p.x(), p.y()) - 0.7);
  return std::hypot(outside, std::max(0.0, std::abs(p.z()) - 1.0));
}

double to_capsule(const Eigen::Vector3d& p) {
  const double along = std::clamp(p.z(), -1.0, 1.0);
  return (p - Eigen::Vector3d(0.0, 0.0, along)).norm() - 0.6;
}

// The nearest surface point solves x_i = r_i^2 p_i / (r_i^2 + t) with the t that puts it on the
// ellipsoid; t by bisection.
double to_ellipsoid(const Eigen::Vector3d& p) {
  const Eigen::Array3d square = Eigen::Array3d(1.5, 0.8, 0.5).square();
  const auto excess = [&](double t) {
    return (square * p.array().square() / (square + t).square()).sum() - 1.0;
  };
  if (excess(0.0) <= 0.0) return 0.0;
  double low = 0.0;
  double high = 100.0;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0.0 ? low : high) = middle;
  }
  return (p.array() - square * p.array() / (square + low)).matrix().norm();
}

INSTANTIATE_TEST_SUITE_P(
    Each, CurvedShapes,
    ::testing::Values(SpeckCase{"sphere", planning::Sphere{1.3}, 1.3,
                                [](const Eigen::Vector3d& p) { return p.norm() - 1.3; }},
                      SpeckCase{"cylinder", planning::Cylinder{0.7, 2.0}, 0.7, to_cylinder},
                      SpeckCase{"capsule", planning::Capsule{0.6, 2.0}, 0.6, to_capsule},
                      SpeckCase{"ellipsoid", planning::Ellipsoid{{1.5, 0.8, 0.5}}, 1.5,
                                to_ellipsoid}),
    [](const auto& param_info) { return std::string(param_info.param.name); });

TEST(ClearanceMeter, MeasuresToHalfSpacesByTheLowestVertex) {
  // A seabed at z = -7 and a wall that fills x >= 3.
  World world;
  world.obstacles.push_back(
      {"seabed", planning::HalfSpace{Eigen::Vector3d::UnitZ()}, at(0, 0, -7)});
  world.obstacles.push_back({"wall", planning::HalfSpace{-Eigen::Vector3d::UnitX()}, at(3, 0, 0)});
  const ClearanceMeter meter(world, box_hull({2.0, 1.0, 0.5}));
  EXPECT_NEAR(meter.clearance(at(0, 0, -6)), 0.75, 1e-12);
  EXPECT_NEAR(meter.clearance(at(1.5, 0, -3)), 0.5, 1e-12);
  const Pose nose_down{Eigen::Vector3d(0, 0, -5), from_rpy(0.0, deg_to_rad(90), 0.0)};
  EXPECT_NEAR(meter.clearance(nose_down), 1.0, 1e-12);
  EXPECT_EQ(meter.clearance(at(0, 0, -9)), 0.0);
}

TEST(ClearanceMeter, FindsWhatIsInsideWithoutTouchingTheSurface) {
  const ClearanceMeter in_rock(world_of(planning::Sphere{5.0}), box_hull({1.0, 0.5, 0.2}));
  EXPECT_EQ(in_rock.clearance(at(1, 1, 1)), 0.0);
  EXPECT_GT(in_rock.clearance(at(6, 0, 0)), 0.4);
  // A pole's end inside the second part of the hull.
  RobotHull hull = box_hull({0.2, 0.2, 0.2});
  hull.parts.push_back(box_solid({5.0, 0.0, 0.0}, {2.0, 2.0, 2.0}));
  const ClearanceMeter swallowed(world_of(Box{{0.1, 0.1, 0.1}}, at(5.3, 0.2, 0)), hull);
  EXPECT_EQ(swallowed.clearance(Pose{}), 0.0);
  EXPECT_NEAR(swallowed.clearance(at(-3, 0, 0)), 2.25, 1e-9);
}

using Names = std::vector<std::string>;

TEST(ClearanceMeter, CountsSeparateContacts) {
  ClearanceMeter meter(world_of(Box{{1.0, 1.0, 1.0}}), box_hull({1.0, 1.0, 1.0}));
  EXPECT_EQ(meter.min_clearance_m(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(meter.nearest_obstacle(), "");
  for (const double x : {3.0, 2.0, 1.5}) EXPECT_EQ(meter.observe(at(x, 0, 0)), Names());
  EXPECT_NEAR(meter.min_clearance_m(), 0.5, 1e-9);
  EXPECT_EQ(meter.observe(at(0.9, 0, 0)), Names({"obstacle"}));
  EXPECT_EQ(meter.min_clearance_m(), 0.0);
  for (const double x : {0.8, 0.95, 1.04, 0.99}) {  // less than 5 cm away: the same contact
    EXPECT_EQ(meter.observe(at(x, 0, 0)), Names()) << x;
  }
  for (const double x : {1.1, 3.0, 1.1}) EXPECT_EQ(meter.observe(at(x, 0, 0)), Names());
  EXPECT_EQ(meter.observe(at(0.9, 0, 0)), Names({"obstacle"}));
}

TEST(ClearanceMeter, CountsAStartInContact) {
  ClearanceMeter meter(world_of(Box{{1.0, 1.0, 1.0}}), box_hull({1.0, 1.0, 1.0}));
  EXPECT_EQ(meter.observe(Pose{}), Names({"obstacle"}));
  EXPECT_EQ(meter.observe(Pose{}), Names());
}

// A seabed (a half-space), a crate within a mesh's reach, a mesh in two pieces, and a pebble inside
// the hull.
TEST(ClearanceMeter, NamesWhatIsTouchedAndWhatIsNearest) {
  World world;
  world.obstacles.push_back(
      {"seabed", planning::HalfSpace{Eigen::Vector3d::UnitZ()}, at(0, 0, -7)});
  world.obstacles.push_back({"crate", Box{{1.0, 1.0, 1.0}}, at(3, 0, -6.5)});
  world.obstacles.push_back({"piece of the wreck", Box{{1.0, 1.0, 1.0}}, at(-3, 0, -5), 0});
  world.obstacles.push_back({"pebble", planning::Sphere{0.1}, at(0, 5, -4)});
  world.surfaces.push_back({"wreck", {{{-3, -1, -8}, {-3, 1, -8}, {-3, 0, 0}}, {{0, 1, 2}}}});
  ClearanceMeter meter(world, box_hull({1.0, 1.0, 1.0}));
  EXPECT_EQ(meter.observe(at(2.2, 0, -5.2)), Names());
  EXPECT_EQ(meter.nearest_obstacle(), "crate");
  EXPECT_NEAR(meter.min_clearance_m(), 0.3, 1e-9);
  EXPECT_EQ(meter.observe(at(0, 0, -6.3)), Names());
  EXPECT_EQ(meter.nearest_obstacle(), "seabed");
  EXPECT_EQ(meter.observe(at(2.2, 0, -6.6)), Names({"seabed", "crate"}));
  EXPECT_EQ(meter.observe(at(0, 0, -6.6)), Names()) << "still on the seabed";
  EXPECT_EQ(meter.observe(at(2.2, 0, -6.6)), Names({"crate"})) << "it was left";
  EXPECT_EQ(meter.observe(at(-2.8, 0, -4)), Names({"wreck"})) << "a mesh has its own name";
  EXPECT_EQ(meter.observe(at(0, 5, -4)), Names({"pebble"}));
}

TEST(ClearanceMeter, NothingIsInfinitelyFarInAnEmptyWorld) {
  ClearanceMeter meter(World{}, box_hull({1.0, 1.0, 1.0}));
  meter.observe(Pose{});
  meter.observe(at(1e6, 0, 0));
  EXPECT_EQ(meter.min_clearance_m(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(meter.nearest_obstacle(), "");
}

World cluttered_room(Random& random) {
  World world;
  world.obstacles.push_back(
      {"seabed", planning::HalfSpace{Eigen::Vector3d::UnitZ()}, at(0, 0, -3)});
  world.obstacles.push_back({"sphere", planning::Sphere{0.5}, at(2, 1, 0)});
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d p(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-3, 3));
    const Eigen::Quaterniond q =
        from_rpy(random.uniform(-3, 3), random.uniform(-1, 1), random.uniform(-3, 3));
    world.obstacles.push_back(
        {fmt::format("box {}", i),
         Box{{random.uniform(0.1, 1.5), random.uniform(0.1, 1.5), random.uniform(0.1, 1.5)}},
         {p, q}});
  }
  return world;
}

// A single obstacle, measured at every pose, and its contacts by the definition.
struct Alone {
  std::string name;
  ClearanceMeter meter;
  bool in_contact = false;

  [[nodiscard]] bool begins_contact(double distance) {
    const bool begins = distance <= 0.0 && !in_contact;
    in_contact = distance <= 0.0 || (in_contact && distance < 0.05);
    return begins;
  }
};

// Skipping must not change the result of measuring every pose against every obstacle: on walks that
// wander, touch and leave, turn on the spot and jump.
TEST(ClearanceMeter, SkippingChangesNothing) {
  const RobotHull hull{
      {box_solid({0.1, 0, 0}, {0.7, 0.4, 0.15}), box_solid({-0.3, 0.2, 0}, {0.2, 0.1, 0.2})}};
  std::size_t contacts_seen = 0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    Random random(seed);
    const World world = cluttered_room(random);
    ClearanceMeter meter(world, hull);
    std::vector<Alone> each;
    for (const planning::Obstacle& obstacle : world.obstacles) {
      each.push_back({obstacle.name, ClearanceMeter(World{{obstacle}}, hull)});
    }
    Pose pose = at(-6, 0, 1);
    Eigen::Vector3d velocity(0.5, 0.1, -0.1);
    double least = std::numeric_limits<double>::infinity();
    std::string nearest;
    for (int i = 0; i < 600; ++i) {
      velocity +=
          0.3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()) - 0.02 * pose.p;
      pose.p += 0.05 * velocity;
      pose.q = (pose.q *
                so3_exp(0.1 * Eigen::Vector3d(random.normal(), random.normal(), random.normal())))
                   .normalized();
      if (i % 150 == 149) pose.p = at(random.uniform(-5, 5), 0, 0).p;
      const Names contacts = meter.observe(pose);
      Names expected;
      for (Alone& one : each) {
        const double distance = one.meter.clearance(pose);
        if (one.begins_contact(distance)) expected.push_back(one.name);
        if (distance >= least) continue;
        least = distance;
        nearest = one.name;
      }
      ASSERT_EQ(contacts, expected) << "seed " << seed << " step " << i;
      ASSERT_NEAR(meter.min_clearance_m(), least, 1e-12) << "seed " << seed << " step " << i;
      if (least > 0.0) {
        ASSERT_EQ(meter.nearest_obstacle(), nearest) << "seed " << seed << " step " << i;
      }
      contacts_seen += contacts.size();
    }
  }
  EXPECT_GT(contacts_seen, 10U);  // the walks do touch walls
}

TEST(ClearanceMeter, MeasuresTheAquaAboveTheSeabed) {
  Diagnostics diagnostics;
  const std::optional<Model> aqua2 = parse_urdf(aqua2_urdf(), diagnostics);
  ASSERT_TRUE(aqua2);
  // The flippers' tips are lowest: (0.2 sin 35 deg + 0.00175 cos 35 deg), plus at most 3 mm.
  const ClearanceMeter meter(world_of(Box{{40.0, 40.0, 1.0}}, at(0, 0, -7.5)), aqua2->hull);
  const double reach = 0.2 * std::sin(0.611) + 0.00175 * std::cos(0.611);
  EXPECT_LE(meter.clearance(at(3, 2, -5)), 2.0 - reach + 1e-9);
  EXPECT_GE(meter.clearance(at(3, 2, -5)), 2.0 - reach - 0.003);
}

}  // namespace
}  // namespace dive::vehicle
