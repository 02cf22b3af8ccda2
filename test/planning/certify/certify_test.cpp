#include "planning/certify/certify.h"

#include <limits>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/assert.h"
#include "planning/certify/bodies.h"
#include "planning/world/sdf.h"
#include "test/planning/boxes.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::arbitrary_double;
using testing::arbitrary_lengths;
using testing::arbitrary_rotation_vector;
using testing::arbitrary_vector;
using testing::box_corners;
using testing::box_to_box;
using testing::draw;
using testing::PlacedBox;
using testing::point_to_box;
using testing::still;

// A vehicle of boxes, each with its pose in B.
struct Vehicle {
  std::vector<PlacedBox> boxes;

  [[nodiscard]] RobotHull hull() const {
    RobotHull hull;
    for (const PlacedBox& box : boxes) {
      ConvexSolid part;
      for (const Vector3d& v : box_corners(box.size)) part.vertices.push_back(box.X_W * v);
      hull.parts.push_back(part);
    }
    return hull;
  }
};

const Vehicle kAqua{{{{0.80, 0.48, 0.22}, Pose{}}}};
const Vehicle kFinned{{{{0.64, 0.20, 0.13}, Pose{}},
                       {{0.20, 0.14, 0.10}, still({0.25, 0.17, 0.0})},
                       {{0.20, 0.14, 0.10}, still({-0.25, -0.17, 0.0})}}};

// Zero in collision; obstacles are boxes, balls and half-spaces.
double distance_at(const Vehicle& vehicle, const Pose& X_WB, const Obstacle& obstacle) {
  double least = 1e300;
  for (const PlacedBox& part : vehicle.boxes) {
    const PlacedBox placed{part.size, X_WB * part.X_W};
    if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
      least = std::min(least, box_to_box(placed, {box->size, obstacle.X_WO}));
    } else if (const auto* ball = std::get_if<Sphere>(&obstacle.shape)) {
      least = std::min(least, point_to_box(obstacle.X_WO.p, placed) - ball->radius);
    } else {
      const Vector3d n = obstacle.X_WO.q * std::get<HalfSpace>(obstacle.shape).normal;
      for (const Vector3d& v : box_corners(part.size)) {
        least = std::min(least, n.dot(placed.X_W * v - obstacle.X_WO.p));
      }
    }
  }
  return std::max(least, 0.0);
}

double distance_at(const Vehicle& vehicle, const Pose& X_WB, const World& world) {
  double least = 1e300;
  for (const Obstacle& obstacle : world.obstacles) {
    least = std::min(least, distance_at(vehicle, X_WB, obstacle));
  }
  return least;
}

// Smallest distance at samples between which no point of the hull moves more than `step`. If a
// sample is far from everything, the next ones within that distance are skipped.
double sampled_clearance(const Vehicle& vehicle, const std::vector<Pose>& path, const World& world,
                         double step) {
  const double radius = vehicle.hull().radius();
  double least = distance_at(vehicle, path[0], world);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double motion =
        (path[i + 1].p - path[i].p).norm() + angle_between(path[i].q, path[i + 1].q) * radius;
    for (double t = 0.0; t < 1.0;) {
      const double d = distance_at(vehicle, interpolate(path[i], path[i + 1], t), world);
      least = std::min(least, d);
      t += std::max(step, d - least) / std::max(motion, step);
    }
  }
  return std::min(least, distance_at(vehicle, path.back(), world));
}

World arbitrary_world() {
  World world;
  const int count = draw(rc::gen::inRange(1, 7));
  for (int i = 0; i < count; ++i) {
    const Vector3d size = draw(arbitrary_lengths());
    const Pose pose{draw(arbitrary_vector(4.0)), so3_exp(draw(arbitrary_rotation_vector()))};
    switch (draw(rc::gen::inRange(0, 4))) {
      case 0:
        world.obstacles.push_back({"ball", Sphere{size.x() / 2.0}, pose});
        break;
      case 1:
        world.obstacles.push_back({"ground", HalfSpace{Vector3d::UnitZ()}, still({0, 0, -3})});
        break;
      default:
        world.obstacles.push_back({"box", Box{size}, pose});
    }
  }
  return world;
}

std::vector<Pose> arbitrary_path() {
  std::vector<Pose> path{{draw(arbitrary_vector(3.0)), so3_exp(draw(arbitrary_rotation_vector()))}};
  const int count = draw(rc::gen::inRange(0, 4));
  for (int i = 0; i < count; ++i) {
    const Vector3d turn = draw(arbitrary_double(0.0, 1.0)) * (draw(arbitrary_rotation_vector()));
    path.push_back({path.back().p + draw(arbitrary_vector(1.0)), path.back().q * so3_exp(turn)});
  }
  return path;
}

TEST(Certificate, DoesNotMissWhatIsAskedForByTheTolerance) {
  constexpr double kSlack = 0.0005;  // m, true clearance beyond the requested one
  int missed = 0;                    // certificates without a requested clearance
  EXPECT_TRUE(rc::check([&] {
    const World world = arbitrary_world();
    const auto path = arbitrary_path();
    const CertifyOptions fine{.tolerance = 1e-5};
    const double truth = Certifier(world, kAqua.hull(), fine).certify(path).clearance_m;
    RC_PRE(truth > kSlack && truth < 1.0);
    const double asked = truth - kSlack;
    Certifier certifier(world, kAqua.hull());
    if (certifier.certify(path).clearance_m < asked) ++missed;
    RC_ASSERT(certifier.certify(path, 5.0, asked).clearance_m >= asked);
    const Certificate enough = certifier.certify(path, asked + 0.002, asked);
    RC_ASSERT(enough.clearance_m >= asked);
    RC_ASSERT(enough.clearance_m <= truth + 1e-4);
  }));
  EXPECT_GT(missed, 0);
}

TEST(Certificate, IsNeverOptimisticAndNoTighterThanItPromises) {
  constexpr double kStep = 0.001;
  int clear = 0;
  EXPECT_TRUE(rc::check([&] {
    const Vehicle& vehicle = draw(rc::gen::arbitrary<bool>()) ? kAqua : kFinned;
    const World world = arbitrary_world();
    const auto path = arbitrary_path();
    const CertifyOptions options;
    const Certificate c = Certifier(world, vehicle.hull(), options).certify(path);
    const double truth = sampled_clearance(vehicle, path, world, kStep);
    RC_ASSERT(c.clearance_m <= truth + 1e-9);
    RC_ASSERT(c.clearance_m <= c.nearest_m);
    if (truth <= 0.0) {
      RC_ASSERT(c.clearance_m <= 0.0);
      return;
    }
    const double expected = std::min(truth, options.cutoff);
    RC_ASSERT(c.clearance_m >= expected - options.tolerance - kStep);
    if (c.obstacle < 0) return;
    ++clear;
    const auto i = static_cast<std::size_t>(c.segment);
    const Pose where = interpolate(path[i], path[std::min(i + 1, path.size() - 1)], c.fraction);
    const Obstacle& nearest = world.obstacles[static_cast<std::size_t>(c.obstacle)];
    RC_ASSERT(std::abs(distance_at(vehicle, where, nearest) - c.nearest_m) < 1e-4);
  }));
  EXPECT_GT(clear, 20);
}

// The only place where a result of FCL enters the bound: wrong points, wherever they are, must not
// make it exceed the distance.
TEST(Certificate, IsABoundWhateverFclAnswers) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const certify::MovingBody body(kAqua.hull().hull_vertices());
  EXPECT_TRUE(rc::check([&] {
    const Pose X_WB{draw(arbitrary_vector(3.0)), so3_exp(draw(arbitrary_rotation_vector()))};
    for (const Obstacle& obstacle : arbitrary_world().obstacles) {
      const certify::FixedBody other(obstacle);
      const double truth = distance_at(kAqua, X_WB, obstacle);
      const Vector3d a = draw(arbitrary_vector(3.0));
      const Vector3d b = draw(arbitrary_vector(3.0));
      for (const Vector3d& answer : {b, a, Vector3d(a + Vector3d::Constant(1e-9)),
                                     Vector3d(kNan, 0.0, 1.0), Vector3d(0.0, kInfinity, 0.0)}) {
        const certify::Separator separator = body.between(X_WB, other, a, answer);
        RC_ASSERT(separator.separation <= truth + 1e-9);  // also false for NaN
      }
    }
  }));
}

TEST(Certificate, FindsTheCollisionInTheMiddleOfAFastTurn) {
  const World post{{{"post", Cylinder{0.03, 4.0}, still({0.0, 0.32, 0.0})}}};
  const std::vector<Pose> turn{{{0, 0, 0}, from_rpy(0, 0, 0)},
                               {{0, 0, 0}, from_rpy(0, 0, deg_to_rad(179.0))}};
  Certifier certifier(post, kAqua.hull());
  EXPECT_NEAR(certifier.certify({&turn[0], 1}).clearance_m, 0.05, 1e-6);
  EXPECT_GT(certifier.certify({&turn[1], 1}).clearance_m, 0.04);
  EXPECT_LE(certifier.certify(turn).clearance_m, 0.0);
}

TEST(Certificate, FindsTheCollisionInTheMiddleOfALongLeg) {
  const World wall{{{"wall", Box{{0.02, 9.0, 9.0}}, still({50.0, 0.0, 0.0})}}};
  const std::vector<Pose> leg{still({0, 0, 0}), still({300, 0, 0})};
  const Certificate c = Certifier(wall, kAqua.hull()).certify(leg);
  EXPECT_LE(c.clearance_m, 0.0);
  EXPECT_EQ(c.obstacle, 0);
}

TEST(Certificate, OfOnePoseIsItsDistance) {
  const World wall{{{"wall", Box{{1.0, 9.0, 9.0}}, still({2.0, 0.0, 0.0})}}};
  const std::vector<Pose> pose{still({0, 0, -1})};
  const Certificate c = Certifier(wall, kAqua.hull()).certify(pose);
  EXPECT_NEAR(c.clearance_m, 1.1, 1e-9);
  EXPECT_NEAR(c.nearest_m, 1.1, 1e-9);
  EXPECT_NEAR(c.highest_z_m, -0.89, 1e-9);
  EXPECT_EQ(c.obstacle, 0);
}

// With parallel faces FCL's GJK is occasionally wrong by up to a metre.
TEST(Certificate, IsRightOnALattice) {
  const World world{{{"box", Box{{2.0, 1.0, 1.5}}, Pose{}}}};
  Certifier certifier(world, Vehicle{{{{0.5, 0.25, 0.5}, Pose{}}}}.hull());
  for (int i = -12; i <= 12; ++i) {
    for (int j = -12; j <= 12; ++j) {
      for (int k = -12; k <= 12; ++k) {
        Pose pose;
        pose.p = 0.125 * Vector3d(i, j, k);
        const Vector3d gap = pose.p.cwiseAbs() - Vector3d(1.25, 0.625, 1.0);
        const double clearance = certifier.certify({&pose, 1}).clearance_m;
        if (gap.maxCoeff() <= 0.0) {
          ASSERT_LE(clearance, 0.0) << pose.p.transpose();
        } else {
          ASSERT_NEAR(clearance, gap.cwiseMax(0.0).norm(), 1e-5) << pose.p.transpose();
        }
      }
    }
  }
}

TEST(Certificate, OfAnEmptyWorldIsTheCutoff) {
  const std::vector<Pose> leg{still({0, 0, -1}), still({3, 0, -1})};
  const Certificate c = Certifier(World{}, kAqua.hull()).certify(leg);
  EXPECT_EQ(c.clearance_m, CertifyOptions{}.cutoff);
  EXPECT_EQ(c.obstacle, -1);
}

TEST(Certificate, IsOfThePartsNotOfTheirHull) {
  // A catamaran: the post passes between its hulls, through the convex hull of both.
  const Vehicle catamaran{
      {{{1.0, 0.2, 0.2}, still({0, 0.5, 0})}, {{1.0, 0.2, 0.2}, still({0, -0.5, 0})}}};
  const World post{{{"post", Cylinder{0.1, 4.0}, still({2.0, 0.0, 0.0})}}};
  const std::vector<Pose> leg{still({0, 0, 0}), still({4, 0, 0})};
  EXPECT_NEAR(Certifier(post, catamaran.hull()).certify(leg).clearance_m, 0.3, 0.0021);
}

TEST(Certificate, IsThatOfANewCertifierAfterAReset) {
  const World near{{{"post", Cylinder{0.1, 4.0}, still({2.0, 0.9, 0.0})}}};
  const World far{{{"post", Cylinder{0.1, 4.0}, still({2.0, 1.6, 0.0})}}};
  const std::vector<Pose> leg{still({0, 0, 0}), {{4, 0, 0}, from_rpy(0.2, 0.1, 0.3)}};
  const CertifyOptions options{.cutoff = 2.0};
  Certifier certifier(near, kAqua.hull());
  const double before = certifier.certify(leg).clearance_m;
  certifier.reset(far, options);
  const Certificate reset = certifier.certify(leg);
  const Certificate fresh = Certifier(far, kAqua.hull(), options).certify(leg);
  EXPECT_EQ(reset.clearance_m, fresh.clearance_m);
  EXPECT_EQ(reset.evaluations, fresh.evaluations);
  EXPECT_GT(reset.clearance_m, before);
  certifier.reset({}, options);
  EXPECT_EQ(certifier.certify(leg).clearance_m, options.cutoff);
}

TEST(Certificate, StaysABoundWhenTheWorkIsCutShort) {
  World world;
  for (int i = 0; i < 20; ++i) {
    const Vector3d at(0.7 * i, i % 2 == 0 ? 1.2 : -1.2, 0.1 * i);
    world.obstacles.push_back({"ball", Sphere{0.4}, still(at)});
  }
  std::vector<Pose> path;
  for (int i = 0; i < 6; ++i)
    path.push_back({{2.5 * i, 0, 0.3 * i}, from_rpy(0.2 * i, 0, 0.3 * i)});
  const double truth = sampled_clearance(kAqua, path, world, 0.001);
  double last = -std::numeric_limits<double>::infinity();
  for (const int work : {1, 10, 40, 20'000}) {
    const Certificate c = Certifier(world, kAqua.hull(), {.max_evaluations = work}).certify(path);
    EXPECT_LE(c.clearance_m, truth + 1e-9) << work;
    EXPECT_LE(c.evaluations, work + 64) << work;
    last = c.clearance_m;
  }
  EXPECT_GT(last, truth - 0.004);
}

TEST(Certificate, BoundsTheHighestPointWhileTurning) {
  EXPECT_TRUE(rc::check([] {
    const auto path = arbitrary_path();
    const Certificate c = Certifier(World{}, kFinned.hull()).certify(path);
    double highest = -1e300;
    for (std::size_t i = 0; i < path.size(); ++i) {
      for (int k = 0; k <= 200; ++k) {
        const Pose pose = interpolate(path[i], path[std::min(i + 1, path.size() - 1)], k / 200.0);
        for (const ConvexSolid& part : kFinned.hull().parts) {
          for (const Vector3d& v : part.vertices) highest = std::max(highest, (pose * v).z());
        }
      }
    }
    RC_ASSERT(c.highest_z_m >= highest - 1e-9);
    RC_ASSERT(c.highest_z_m < highest + 0.5 * M_PI * M_PI / 8.0 + 1e-9);
  }));
}

TEST(Certificate, DemandsFinitePoses) {
  Certifier certifier(World{}, kAqua.hull());
  EXPECT_THROW((void)certifier.certify({}), AssertionFailure);
  const std::vector<Pose> nowhere{still({0, 0, std::nan("")})};
  EXPECT_THROW((void)certifier.certify(nowhere), AssertionFailure);
}

TEST(Certificate, ThroughTheWindowIsAMetreAndOnTheStraightLineNone) {
  Diagnostics diagnostics;
  const auto world = load_sdf(DIVE_SOURCE_DIR "/missions/maps/window.sdf", diagnostics);
  ASSERT_TRUE(world);
  Certifier certifier(*world, kAqua.hull());
  const std::vector<Vector3d> corners{{-1.0, -2.0, -4.0}, {3.2, 0.9, -4.5}, {4.7, 2.1, -4.6},
                                      {6.15, 2.1, -4.6},  {7.6, 2.1, -4.6}, {9.8, -2.0, -4.6}};
  std::vector<Pose> path;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector3d leg =
        corners[std::min(i + 1, corners.size() - 1)] - corners[std::min(i, corners.size() - 2)];
    path.push_back({corners[i], from_rpy(0, 0, std::atan2(leg.y(), leg.x()))});
  }
  const Certificate through = certifier.certify(path);
  EXPECT_GE(through.clearance_m, 1.0);
  EXPECT_LE(through.clearance_m, sampled_clearance(kAqua, path, *world, 0.001) + 1e-9);

  const std::vector<Pose> straight{path.front(), {corners.back(), path.front().q}};
  const Certificate blocked = certifier.certify(straight);
  EXPECT_LE(blocked.clearance_m, 0.0);
  EXPECT_EQ(world->obstacles[static_cast<std::size_t>(blocked.obstacle)].name,
            "rooms/wall_dividing/jamb_south");
}

}  // namespace
}  // namespace dive::planning
