// The observed map against surfaces with known equations. Scans are made here, ray by ray;
// distances to pieces are measured here, triangle by triangle.

#include "planning/mapping/mapper.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/clock.h"
#include "common/random.h"
#include "planning/world/observed_map.h"
#include "test/planning/mapping/flat_distance.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Distance along a ray to the nearest surface; infinite if there is none.
using Surface = std::function<double(const Vector3d& from, const Vector3d& way)>;

constexpr double kReach = 10.0;
constexpr double kOnPiece = 0.04 + 2.0 * (0.01 + 0.005 * 8.0);  // m: the stated tolerance at 8 m
constexpr double kNever = std::numeric_limits<double>::infinity();

Surface box(const Vector3d& low, const Vector3d& high) {
  return [=](const Vector3d& from, const Vector3d& way) {
    double enter = 0.0;
    double leave = kNever;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (low[axis] - from[axis]) / way[axis];
      const double b = (high[axis] - from[axis]) / way[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter < leave && enter > 0.0 ? enter : kNever;
  };
}

Surface all_of(std::vector<Surface> surfaces) {
  return [surfaces](const Vector3d& from, const Vector3d& way) {
    double nearest = kNever;
    for (const Surface& surface : surfaces) nearest = std::min(nearest, surface(from, way));
    return nearest;
  };
}

/// Scans of 100 x 75 rays over 120 x 90 degrees, straight ahead.
class Eye {
 public:
  // With noise, because no sensor gives two equal scans, bit for bit.
  explicit Eye(Surface surface, double noise = 1e-5, std::uint64_t seed = 1)
      : surface_(std::move(surface)), noise_(noise), random_(seed) {}

  RangeScan look(const Pose& X_WB) {
    RangeScan scan;
    scan.utime = now_ += 50'000;
    scan.origin_B = Vector3f(0.3F, 0.0F, 0.0F);
    for (int row = 0; row < 75; ++row) {
      for (int column = 0; column < 100; ++column) {
        const Vector3d way_B =
            Vector3d(1.0, std::tan(deg_to_rad(60.0)) * (1.0 - (column + 0.5) / 50.0),
                     1.0 - (row + 0.5) / 37.5)
                .normalized();
        const double range = surface_(X_WB * scan.origin_B.cast<double>(), X_WB.q * way_B) +
                             noise_ * random_.normal();
        const double measured = range <= kReach ? range : 2.0 * kReach;
        scan.points_B.push_back(scan.origin_B + (measured * way_B).cast<float>());
      }
    }
    return scan;
  }

  Utime now() const { return now_; }
  void set_surface(Surface surface) { surface_ = std::move(surface); }

 private:
  Surface surface_;
  double noise_;
  Random random_;
  Utime now_ = 0;
};

RobotHull vehicle() {
  RobotHull hull;
  ConvexSolid part{"hull", {}};
  for (const double x : {-0.35, 0.35})
    for (const double y : {-0.22, 0.22})
      for (const double z : {-0.07, 0.07}) part.vertices.emplace_back(x, y, z);
  hull.parts.push_back(part);
  return hull;
}

std::vector<Polytope> polytopes_of(const ObservedMap& map) {
  std::vector<Polytope> polytopes;
  map.visit_cells([&](CellKey, std::span<const ObservedMap::Piece> pieces) {
    for (const auto& piece : pieces) polytopes.push_back(std::get<Polytope>(piece.obstacle.shape));
  });
  return polytopes;
}

double to_map(const Vector3d& p, const ObservedMap& map) {
  double least = kNever;
  for (const Polytope& piece : polytopes_of(map)) {
    const Vector3d& opposite = piece.vertices[piece.vertices.size() / 2];
    const double extent = (piece.vertices.front() - opposite).norm();
    if ((p - piece.vertices.front()).norm() > 2.0 + 2.0 * extent) continue;
    least = std::min(least, to_piece(p, piece));
  }
  return least;
}

/// A mapper with simulated scans.
struct Dive {
  explicit Dive(Surface surface, double noise = 1e-5, MapperOptions options = {})
      : eye(std::move(surface), noise), mapper(vehicle(), options, clock) {}

  std::optional<ScanResult> look(const Pose& X_WB, const Vector3d& v_W = Vector3d::Zero()) {
    std::optional<ScanResult> result = mapper.add(eye.look(X_WB), {X_WB, v_W});
    if (result) {
      EXPECT_TRUE(map.apply(result->obstacles));
    }
    return result;
  }
  void look(const Pose& X_WB, int times) {
    for (int i = 0; i < times; ++i) static_cast<void>(look(X_WB));
  }

  SteadyClock clock;
  Eye eye;
  Mapper mapper;
  ObservedMap map;
};

MapperOptions in_one_go() {
  MapperOptions options;
  options.points_per_update = 1'000'000;
  return options;
}

const Pose kHere{Vector3d(0.0, 0.0, -5.0), Eigen::Quaterniond::Identity()};
const Surface kPlate = box({3.0, -20.0, -20.0}, {4.0, 20.0, 20.0});
const Surface kCube = box({3.0, -0.5, -5.5}, {4.0, 0.5, -4.5});

struct Judgement {
  double worst_m = 0.0;  ///< Largest distance of the surface from the map, m.
  double blocked = 0.0;  ///< Share of the free rays that are blocked, up to 0.1 m before the hit.
  int surface = 0;
  int rays = 0;
};

// Uses rays between those of the scans.
Judgement judge(const Surface& surface, const ObservedMap& map, const Pose& X_WB) {
  Judgement result;
  const Vector3d eye = X_WB * Vector3d(0.3, 0.0, 0.0);
  int blocked = 0;
  for (int row = 2; row < 73; ++row) {
    for (int column = 2; column < 98; ++column) {
      const Vector3d way =
          X_WB.q *
          Vector3d(1.0, std::tan(deg_to_rad(60.0)) * (1.0 - column / 50.0), 1.0 - row / 37.5)
              .normalized();
      const double range = surface(eye, way);
      const double end = std::min(range, kReach) - 0.1;
      ++result.rays;
      for (double at = 0.3; at < end;) {
        const double distance = to_map(eye + at * way, map);
        if (distance <= 0.0) {
          ++blocked;
          break;
        }
        at += std::max(distance, 0.005);
      }
      if (range > kReach) continue;
      ++result.surface;
      result.worst_m = std::max(result.worst_m, to_map(eye + range * way, map));
    }
  }
  result.blocked = static_cast<double>(blocked) / result.rays;
  return result;
}

TEST(MapperTest, CoversAPlateAndBlocksNoWaterBeforeIt) {
  Dive dive(box({3.0, -4.0, -8.0}, {4.0, 4.0, -2.0}), 1e-5, in_one_go());
  dive.look(kHere, 8);
  const Judgement judgement = judge(box({3.0, -3.8, -7.8}, {4.0, 3.8, -2.2}), dive.map, kHere);
  EXPECT_GT(judgement.surface, 3000);
  EXPECT_LE(judgement.worst_m, 0.0);
  EXPECT_LE(judge(box({3.0, -4.0, -8.0}, {4.0, 4.0, -2.0}), dive.map, kHere).blocked, 0.002);
}

TEST(MapperTest, CoversACubeAndBlocksNoWaterBesideIt) {
  Dive dive(kCube, 1e-5, in_one_go());
  dive.look(kHere, 8);
  // Up to where the last ray before an edge may have hit it.
  const Judgement judgement = judge(box({3.0, -0.44, -5.44}, {4.0, 0.44, -4.56}), dive.map, kHere);
  EXPECT_GT(judgement.surface, 50);
  EXPECT_LE(judgement.worst_m, 0.05);
  EXPECT_LE(judge(kCube, dive.map, kHere).blocked, 0.005);
}

// The measures themselves can fail.
TEST(MapperTest, TheMeasuresSeeAHoleAndAHullThatIsTooLarge) {
  const Surface corner =
      all_of({box({2.0, 1.5, -8.0}, {6.0, 2.0, -2.0}), box({6.0, -2.0, -8.0}, {6.5, 2.0, -2.0})});
  ObservedMap hull;
  Polytope lid{{{2.0, 1.5, -8.0}, {2.0, 1.5, -2.0}, {6.0, -2.0, -2.0}, {6.0, -2.0, -8.0}}, 0.02};
  ASSERT_TRUE(hull.apply({ObstacleSource::kMapper, 1, {{1, {lid}}}}));
  EXPECT_GT(judge(corner, hull, kHere).blocked, 0.1);
  EXPECT_GT(judge(corner, hull, kHere).worst_m, 0.5);
}

TEST(MapperTest, EveryPointThatSurvivesIsOnAPieceInSpiteOfNoise) {
  const Surface room =
      all_of({box({5.0, -5.0, -9.0}, {6.0, 5.0, 0.0}), box({-5.0, 2.0, -9.0}, {6.0, 3.0, 0.0}),
              box({-5.0, -9.0, -9.0}, {6.0, 9.0, -7.0}), kCube});
  Dive dive(room, 0.02);
  for (int i = 0; i < 40; ++i) {
    Pose X_WB = kHere;
    X_WB.p.x() = 0.02 * i;
    dive.look(X_WB, 1);
    if (i % 8 != 3) continue;
    for (const Vector3f& p : dive.mapper.points()) {
      ASSERT_LE(to_map(p.cast<double>(), dive.map), kOnPiece) << "after scan " << i;
    }
  }
  EXPECT_GT(dive.mapper.points().size(), 1000U);
}

// Round the end of a wall and on along its side, which gives no features along it: the end must not
// hold the vehicle back once it is out of view. Each of these routes was held back once.
TEST(MapperTest, ASmoothWallBlocksNothingBeforeIt) {
  struct Way {
    std::uint64_t seed;
    int turn;  ///< Number of scans during the turn.
    double y;
  };
  for (const Way& way : {Way{1, 60, -5.6}, {2, 120, -5.85}, {3, 120, -5.6}}) {
    Eye eye(all_of({box({-5, -5, -6}, {35, -4, 1}), box({-20, -20, -7}, {40, 20, -6})}), 0.02,
            way.seed);
    SteadyClock clock;
    Mapper mapper(vehicle(), {}, clock);
    constexpr double kStep = 0.015;  // m per scan: 0.3 m/s
    Vector3d p(-5.95, -3.8, -1.0);
    Vector3d off = Vector3d::Zero();  // correction of the estimate, whose dead reckoning is exact
    const auto swim = [&](const Vector3d& step, double yaw_deg) {
      p += step;
      const Eigen::Quaterniond q = from_rpy(0, 0, deg_to_rad(yaw_deg));
      const auto result = mapper.add(eye.look({p, q}), {{p + off, q}, step / 0.05});
      ASSERT_TRUE(result);
      if (result->correction) off.head<2>() += result->correction->correction_W;
    };
    while (p.y() > way.y) swim({0, -kStep, 0}, -80.0);
    for (int i = 0; i < way.turn; ++i) swim(Vector3d::Zero(), -80.0 + 80.0 * i / (way.turn - 1));
    while (p.x() < -2.0) swim({kStep, 0, 0}, 0.0);
    EXPECT_LT(off.norm(), 0.4) << way.seed << ' ' << way.turn;
  }
}

TEST(MapperTest, LeavesADoorOpen) {
  // 0.8 m wide, in a wall that is observed from both sides.
  const Surface wall =
      all_of({box({3.0, -5.0, -9.0}, {3.2, -0.4, 0.0}), box({3.0, 0.4, -9.0}, {3.2, 5.0, 0.0})});
  Dive dive(wall, 0.01);
  dive.look(kHere, 20);
  for (double x = 2.0; x < 4.0; x += 0.05) {
    EXPECT_GT(to_map({x, 0.0, -5.0}, dive.map), 0.25) << x;
  }
  EXPECT_LT(to_map({3.0, 1.0, -5.0}, dive.map), 0.05);
}

TEST(MapperTest, WhatIsThereAlreadyChangesNothing) {
  Dive dive(kPlate);
  dive.look(kHere, 40);
  ASSERT_GT(dive.map.pieces(), 10U);
  for (int i = 0; i < 10; ++i) {
    Pose X_WB = kHere;
    X_WB.p.y() = 1e-4 * i;  // no two scans are equal
    const std::optional<ScanResult> result = dive.look(X_WB);
    ASSERT_TRUE(result.has_value());
    EXPECT_TRUE(result->obstacles.cells.empty()) << result->obstacles.cells.size();
  }
}

TEST(MapperTest, LonePointsAreNoObstacles) {
  Dive dive(kPlate);
  Random random(3);
  for (int i = 0; i < 30; ++i) {
    RangeScan scan = dive.eye.look(kHere);
    for (int k = 0; k < 40; ++k) {  // marine snow, elsewhere in each scan
      const auto at = static_cast<std::size_t>(random.uniform(0.0, 7499.0));
      const Vector3f way = (scan.points_B[at] - scan.origin_B).normalized();
      scan.points_B[at] = scan.origin_B + way * static_cast<float>(random.uniform(0.4, 2.0));
    }
    for (int k = 0; k < 100; ++k) {
      scan.points_B[static_cast<std::size_t>(random.uniform(0.0, 7499.0))].fill(
          std::numeric_limits<float>::quiet_NaN());
    }
    if (auto result = dive.mapper.add(scan, {kHere})) {
      EXPECT_TRUE(dive.map.apply(result->obstacles));
    }
  }
  for (const Polytope& piece : polytopes_of(dive.map)) {
    for (const Vector3d& v : piece.vertices) EXPECT_GT(v.x(), 2.8);
  }
}

// Sets the range of the pixels around (row, column) of the scan, `tall` up and down and `wide` to
// each side.
void put_before(RangeScan& scan, int row, int column, int tall, int wide, float range) {
  for (int r = row - tall; r <= row + tall; ++r) {
    for (int c = column - wide; c <= column + wide; ++c) {
      const auto at = static_cast<std::size_t>(r * 100 + c);
      scan.points_B[at] = scan.origin_B + (scan.points_B[at] - scan.origin_B).normalized() * range;
    }
  }
}

TEST(MapperTest, AMoteBeforeTheLensIsNoObstacleAndARodIs) {
  for (const int tall : {1, 20}) {
    Dive dive(kPlate);
    for (int i = 0; i < 20; ++i) {
      RangeScan scan = dive.eye.look(kHere);
      put_before(scan, 37, 50, tall, 1, 0.35F);
      if (auto result = dive.mapper.add(scan, {kHere})) {
        EXPECT_TRUE(dive.map.apply(result->obstacles));
      }
    }
    bool any_near = false;
    for (const Polytope& piece : polytopes_of(dive.map)) {
      for (const Vector3d& v : piece.vertices) any_near |= v.x() < 2.0;
    }
    EXPECT_EQ(any_near, tall > 1) << tall;
  }
}

// Of a plate above the view only the top row of pixels sees the lower edge.
TEST(MapperTest, AnEdgeThatRisesIntoTheViewIsAnObstacle) {
  Dive dive(box({2.0, -0.15, -3.345}, {2.01, 0.15, -3.0}));
  dive.look(kHere, 2);
  EXPECT_LT(to_map({2.0, 0.0, -3.33}, dive.map), 0.1);
}

TEST(MapperTest, WhatHasGoneAwayIsRemovedByPassingRays) {
  Dive dive(all_of({kPlate, kCube}));
  const Surface diver = box({1.5, -0.3, -5.3}, {2.0, 0.3, -4.7});
  dive.eye.set_surface(all_of({kPlate, diver}));
  dive.look(kHere, 10);
  EXPECT_LT(to_map({1.5, 0.0, -5.0}, dive.map), 0.0);
  dive.eye.set_surface(kPlate);
  Pose X_WB = kHere;
  for (int i = 0; i < 14; ++i) {
    X_WB.p.y() += 0.01;
    static_cast<void>(dive.look(X_WB));
  }
  EXPECT_GT(to_map({1.5, 0.0, -5.0}, dive.map), 1.0);
}

TEST(MapperTest, IsTheSameEveryTime) {
  Dive one(all_of({kPlate, kCube}), 0.02);
  Dive other(all_of({kPlate, kCube}), 0.02);
  for (int i = 0; i < 20; ++i) {
    Pose X_WB = kHere;
    X_WB.p.x() = 0.02 * i;
    const auto a = one.look(X_WB);
    const auto b = other.look(X_WB);
    ASSERT_TRUE(a && b);
    const std::vector<MapCell>& cells = a->obstacles.cells;
    const std::vector<MapCell>& others = b->obstacles.cells;
    ASSERT_EQ(cells.size(), others.size());
    EXPECT_EQ(a->free_ahead.free_ahead_m, b->free_ahead.free_ahead_m);
    for (std::size_t c = 0; c < cells.size(); ++c) {
      ASSERT_EQ(cells[c].key, others[c].key);
      ASSERT_EQ(cells[c].pieces.size(), others[c].pieces.size());
      for (std::size_t p = 0; p < cells[c].pieces.size(); ++p) {
        EXPECT_EQ(cells[c].pieces[p].vertices, others[c].pieces[p].vertices);
        EXPECT_EQ(cells[c].pieces[p].radius, others[c].pieces[p].radius);
      }
    }
  }
}

// A known wall 4 m ahead and a box, which the map lacks, 1 m before it; the position is 0.2 m off.
TEST(MapperTest, BesideAKnownMapItMapsOnlyWhatThatLacks) {
  const Surface wall = box({4.0, -10.0, -10.0}, {4.5, 10.0, 10.0});
  const Surface unknown = box({2.8, -0.3, -0.3}, {3.0, 0.3, 0.3});
  Eye eye(all_of({wall, unknown}), 1e-5);
  const auto is_wall = [](const Vector3f& p_W, double tolerance) {
    return std::abs(static_cast<double>(p_W.x()) - 4.0) <= tolerance;
  };
  for (const double sigma : {0.0, 0.1}) {
    SteadyClock clock;
    Mapper mapper(vehicle(), {}, clock, is_wall);
    ObservedMap map;
    for (int scan = 0; scan < 4; ++scan) {
      const Pose off{Vector3d(0.2, 0.0, 0.0), Eigen::Quaterniond::Identity()};
      const auto result =
          mapper.add(eye.look(Pose{}), {off, Vector3d::Zero(), sigma, deg_to_rad(0.5)});
      ASSERT_TRUE(result);
      EXPECT_FALSE(result->correction) << "the known map corrects the position";
      EXPECT_TRUE(map.apply(result->obstacles));
      EXPECT_EQ(map.pieces() > 0, scan >= 1) << "with the second scan that shows it";
    }
    EXPECT_LT(to_map({3.0, 0.0, 0.0}, map), 0.05) << "the box, where the scan places it";
    const bool wall_is_mapped = to_map({4.2, 2.0, 0.0}, map) < 0.05;
    EXPECT_EQ(wall_is_mapped, sigma == 0.0) << "within three sigmas of the known wall it is known";
  }
}

TEST(MapperTest, MapsAKnownSurfaceThatIsInTheVehiclesWay) {
  const Surface wall = box({3.0, -10.0, -10.0}, {3.5, 10.0, 10.0});
  Eye eye(wall, 1e-5);
  const auto is_wall = [](const Vector3f& p_W, double tolerance) {
    return std::abs(static_cast<double>(p_W.x()) - 3.0) <= tolerance;
  };
  SteadyClock clock;
  Mapper mapper(vehicle(), {}, clock, is_wall);
  ObservedMap map;
  const auto look = [&](const std::optional<ObstacleAhead>& ahead) {
    ScanPose pose{Pose{}, Vector3d::Zero(), 0.0, deg_to_rad(0.5)};
    pose.ahead = ahead;
    const auto result = mapper.add(eye.look(Pose{}), pose);
    ASSERT_TRUE(result);
    EXPECT_TRUE(map.apply(result->obstacles));
  };
  for (int scan = 0; scan < 3; ++scan) look(std::nullopt);
  EXPECT_EQ(map.pieces(), 0u);
  look(ObstacleAhead{0, 1.0, {3.0, 0.0, 0.0}});
  for (int scan = 0; scan < 3; ++scan) look(std::nullopt);  // the vehicle has stopped
  EXPECT_LT(to_map({3.0, 0.0, 0.0}, map), 0.1);
  EXPECT_GT(to_map({3.0, 3.0, 0.0}, map), 0.5) << "elsewhere it is still the known wall";
}

TEST(MapperTest, RejectsWhatNoWorkingSensorSends) {
  Dive dive(kPlate);
  const RangeScan scan = dive.eye.look(kHere);
  ASSERT_TRUE(dive.mapper.add(scan, {kHere}));
  RangeScan again = scan;
  again.utime += 50'000;
  EXPECT_FALSE(dive.mapper.add(again, {kHere}));
  EXPECT_EQ(dive.mapper.problem(), ScanProblem::kRepeated);
  RangeScan before = scan;
  before.utime -= 1;
  before.points_B[5].x() += 0.1F;
  EXPECT_FALSE(dive.mapper.add(before, {kHere}));
  EXPECT_EQ(dive.mapper.problem(), ScanProblem::kBackwards);
  RangeScan empty = scan;
  empty.utime += 100'000;
  for (Vector3f& p : empty.points_B) p.fill(std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(dive.mapper.add(empty, {kHere}));
  EXPECT_EQ(dive.mapper.problem(), ScanProblem::kEmpty);
  empty.points_B.clear();
  EXPECT_FALSE(dive.mapper.add(empty, {kHere}));
  RangeScan huge = scan;
  huge.utime += 150'000;
  huge.points_B.resize(kMaxScanPoints + 1, Vector3f(3.0F, 0.0F, 0.0F));
  EXPECT_FALSE(dive.mapper.add(huge, {kHere}));
  EXPECT_EQ(dive.mapper.problem(), ScanProblem::kEmpty);
  EXPECT_TRUE(dive.look(Pose{Vector3d(0.1, 0.0, -5.0), kHere.q}));
}

TEST(MapperTest, IsBoundedWhenItIsSurrounded) {
  Dive dive([](const Vector3d&, const Vector3d&) { return 0.5; });
  for (int i = 0; i < 10; ++i) {
    Pose X_WB = kHere;
    X_WB.q = from_rpy(0.0, 0.0, 0.7 * i);
    const auto update = dive.look(X_WB);
    ASSERT_TRUE(update.has_value());
    EXPECT_LT(update->free_ahead.free_ahead_m, 1.2);
  }
  EXPECT_LT(to_map({0.8, 0.0, -5.0}, dive.map), 0.05);
}

TEST(MapperTest, ForgetsWhatIsOldAndWhatIsTooMuch) {
  MapperOptions options;
  options.memory_s = 5.0;
  Dive dive(kPlate, 1e-5, options);
  dive.look(kHere, 10);
  EXPECT_GT(dive.mapper.stats().voxels, 500U);
  dive.eye.set_surface([](const Vector3d&, const Vector3d&) { return kNever; });
  Pose away = kHere;
  away.q = from_rpy(0.0, 0.0, 3.0);
  for (int i = 0; i < 140; ++i) {
    away.p.y() += 1e-3;
    static_cast<void>(dive.look(away));
  }
  EXPECT_EQ(dive.mapper.stats().voxels, 0U);
  EXPECT_EQ(dive.map.pieces(), 0U);

  options = {};
  options.max_voxels = 2000;
  Dive narrow(kPlate, 1e-5, options);
  for (int i = 0; i < 100; ++i) {
    Pose X_WB = kHere;
    X_WB.p.y() = 0.5 * i;
    static_cast<void>(narrow.look(X_WB));
    EXPECT_LE(narrow.mapper.stats().voxels, 2000U);
  }
}

TEST(MapperTest, MovesWithALoopClosure) {
  Dive dive(kPlate);
  dive.look(kHere, 10);
  const Pose shift{Vector3d(0.0, 0.0, 0.0), from_rpy(0.0, 0.0, 0.5)};
  const ObstacleUpdate moved = dive.mapper.move({{{0, {0.5, {0.0, 0.0}}}}});
  ASSERT_TRUE(dive.map.apply(moved)) << "later than the last scan";
  // The plate x = 3, rotated.
  EXPECT_LT(to_map(shift * Vector3d(3.0, 0.0, -5.0), dive.map), 0.1);
  EXPECT_GT(to_map({3.0 * std::cos(0.5) - 1.0, 0.0, -5.0}, dive.map), 0.5);
  for (const Polytope& piece : polytopes_of(dive.map)) {
    for (const Vector3d& v : piece.vertices) EXPECT_NEAR((shift.inverse() * v).x(), 3.0, 0.25);
  }
}

// 20,700 single points, each of which is a piece.
TEST(MapperTest, WhatMovesIsBounded) {
  SteadyClock clock;
  Mapper mapper(vehicle(), {}, clock);
  std::vector<Vector3f> points;
  for (int x = 0; x < 30; ++x)
    for (int y = 0; y < 30; ++y)
      for (int z = 0; z < 23; ++z)
        points.emplace_back(0.5F * static_cast<float>(x), 0.5F * static_cast<float>(y),
                            -1.0F - 0.5F * static_cast<float>(z));
  ObservedMap map;
  ASSERT_TRUE(map.apply(mapper.add_cloud(points)));
  EXPECT_EQ(map.pieces(), points.size());
  ASSERT_TRUE(map.apply(mapper.move({{{0, {0.2, {5.0, 0.0}}}}})));
  EXPECT_LE(map.pieces(), 16'384U);
  EXPECT_GT(map.pieces(), 16'000U);
}

TEST(MapperTest, FreeAheadEndsWithTheObservedSpace) {
  Dive dive(kPlate);
  const auto ahead = dive.look(kHere);
  ASSERT_TRUE(ahead);
  EXPECT_NEAR(ahead->free_ahead.free_ahead_m, 3.0 - 0.35, 0.35);  // up to the plate
  // Behind it nothing was observed: free only as far as the vehicle's own position implies.
  Pose X_WB = kHere;
  X_WB.p.y() += 0.001;
  const auto back = dive.look(X_WB, Vector3d(-0.4, 0.0, 0.0));
  ASSERT_TRUE(back);
  EXPECT_LE(back->free_ahead.free_ahead_m, 0.7);
}

TEST(MapperTest, TakesACloudAsItIs) {
  SteadyClock clock;
  Mapper mapper(vehicle(), {}, clock);
  std::vector<Vector3f> points;
  for (int x = 0; x < 60; ++x)
    for (int y = 0; y < 60; ++y)
      points.emplace_back(0.08F * static_cast<float>(x), 0.08F * static_cast<float>(y), -3.0F);
  points.emplace_back(20.0F, 20.0F, -3.0F);  // a single point stays
  ObservedMap map;
  EXPECT_TRUE(map.apply(mapper.add_cloud(points)));
  double worst = 0.0;  // one point is kept per voxel
  for (const Vector3f& p : points) worst = std::max(worst, to_map(p.cast<double>(), map));
  EXPECT_LE(worst, 0.14);
  EXPECT_LT(map.pieces(), 150U);
}

}  // namespace
}  // namespace dive::planning
