// Queries of the observed map, against a list of all pieces that is searched from end to end.

#include "mission/executive/map_view.h"

#include <cmath>
#include <limits>
#include <map>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/random.h"
#include "planning/world/overhead.h"
#include "planning/world/scene.h"
#include "planning/world/sounding.h"
#include "test/planning/boxes.h"

namespace dive::mission {
namespace {

using dive::testing::PlacedBox;
using Eigen::Vector3d;
using planning::ObservedMap;
using planning::ObstacleUpdate;

const Vector3d kHullSize(0.6, 0.4, 0.2);

planning::Polytope polytope_of(const PlacedBox& box) {
  planning::Polytope polytope;
  for (const Vector3d& corner : dive::testing::box_corners(box.size)) {
    polytope.vertices.push_back(box.X_W * corner);
  }
  return polytope;
}

planning::RobotHull hull() { return {{{"body", polytope_of({kHullSize, Pose{}}).vertices}}}; }

// Boxes in cells, changed at random: the map of a mapper and the true obstacles.
class Surroundings {
 public:
  explicit Surroundings(std::uint64_t seed) : random_(seed) {}

  ObstacleUpdate next() {
    ObstacleUpdate update;
    update.utime = ++utime_;
    for (planning::CellKey key = 0; key < 40; ++key) {
      if (random_.bits() % 4 != 0) continue;
      std::vector<PlacedBox>& boxes = cells_[key];
      boxes.resize(random_.bits() % 5);
      planning::MapCell& cell = update.cells.emplace_back();
      cell.key = key;
      for (PlacedBox& box : boxes) {
        box.size = {between(0.1, 1.0), between(0.1, 1.0), between(0.1, 1.0)};
        box.X_W = {{between(-8, 8), between(-8, 8), between(-9, 0.2)},
                   from_rpy(between(-3, 3), between(-1.5, 1.5), between(-3, 3))};
        cell.pieces.push_back(polytope_of(box));
      }
    }
    return update;
  }

  [[nodiscard]] std::vector<PlacedBox> boxes() const {
    std::vector<PlacedBox> all;
    for (const auto& [key, boxes] : cells_) all.insert(all.end(), boxes.begin(), boxes.end());
    return all;
  }
  [[nodiscard]] planning::World world() const {
    planning::World world;
    for (const PlacedBox& box : boxes()) {
      world.obstacles.push_back({"box", planning::Box{box.size}, box.X_W});
    }
    return world;
  }
  double between(double low, double high) { return low + (high - low) * random_.uniform(); }

 private:
  Random random_;
  Utime utime_ = 0;
  std::map<planning::CellKey, std::vector<PlacedBox>> cells_;
};

RC_GTEST_PROP(MapView, KnowsNoMoreClearanceThanThereIs, (std::uint64_t seed)) {
  Surroundings surroundings(seed);
  const planning::World nothing;
  const planning::RobotHull robot = hull();
  MapView map(nothing, robot);
  ObservedMap observed;
  for (int round = 0; round < 3; ++round) RC_ASSERT(observed.apply(surroundings.next()));
  RC_ASSERT(map.update(observed));
  std::vector<Pose> way;
  for (int i = 0; i < 4; ++i) {
    way.push_back({{-6.0 + 4.0 * i, surroundings.between(-3, 3), surroundings.between(-6, -1)},
                   from_rpy(0, 0, surroundings.between(-0.5, 0.5))});
  }
  constexpr int kSamples = 200;  // of a segment: every 3 cm
  double least = 1.5;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    for (int k = 0; k <= kSamples; ++k) {
      const PlacedBox at{kHullSize,
                         interpolate(way[i], way[i + 1], static_cast<double>(k) / kSamples)};
      for (const PlacedBox& box : surroundings.boxes()) {
        if ((box.X_W.p - at.X_W.p).norm() > 3.5) continue;
        least = std::min(least, dive::testing::box_to_box(at, box));
      }
    }
  }
  const double clearance = map.clearance(way);
  RC_ASSERT(clearance <= least + 1e-6);
  if (least > 0.05) RC_ASSERT(clearance >= least - 0.05);
}

// Through a passage of many small pieces, as a mapper leaves them behind.
TEST(MapView, EvaluatesALongPathToItsEnd) {
  constexpr int kLength = 40;  // m
  ObstacleUpdate update;
  update.utime = 1;
  for (int x = 0; x < kLength; ++x) {
    planning::MapCell& cell = update.cells.emplace_back();
    cell.key = x;
    for (int i = 0; i < 400; ++i) {
      const Vector3d at(x + 0.1 * (i % 10), i % 20 < 10 ? 1.05 : -1.05, -6.0 + 0.1 * (i / 20));
      cell.pieces.push_back(polytope_of({Vector3d::Constant(0.1), Pose{at}}));
    }
  }
  const planning::World nothing;
  const planning::RobotHull robot = hull();
  MapView map(nothing, robot);
  ObservedMap observed;
  ASSERT_TRUE(observed.apply(update) && map.update(observed));
  std::vector<Pose> way;
  for (int i = 0; i < 2 * kLength; ++i) {
    way.push_back({{0.5 * i, 0.1 * std::sin(0.7 * i), -5.0}, from_rpy(0, 0, 0.2 * std::cos(i))});
  }
  // 1 to the wall, 0.1 aside, 0.2 half a width, and some of the length for its yaw.
  const double clearance = map.clearance(way);
  EXPECT_LT(clearance, 0.71);
  EXPECT_GT(clearance, 0.55);
}

bool is_alike(const std::optional<double>& a, const std::optional<double>& b) {
  return a.has_value() == b.has_value() && (!a || std::abs(*a - *b) < 0.05);
}

// Straight down it passes something so closely that a few millimetres decide.
bool is_at_an_edge(const planning::Scene& scene, const Vector3d& p_W) {
  const std::optional<double> ground = planning::ground_below(scene, p_W);
  constexpr double kAside = 0.003;  // m
  for (const auto& [x, y] : {std::pair(1, 1), {1, -1}, {-1, 1}, {-1, -1}}) {
    const Vector3d aside(kAside * x, kAside * y, 0.0);
    if (!is_alike(planning::ground_below(scene, p_W + aside), ground)) return true;
  }
  return false;
}

RC_GTEST_PROP(MapView, LooksUpAndDownAsIfItLookedAtAll, (std::uint64_t seed)) {
  Surroundings surroundings(seed);
  const planning::World nothing;
  const planning::RobotHull robot = hull();
  MapView map(nothing, robot);
  ObservedMap observed;
  for (int round = 0; round < 3; ++round) {
    RC_ASSERT(observed.apply(surroundings.next()));
    map.update(observed);
    const planning::World world = surroundings.world();
    planning::OverheadIndex overheads(world);
    const planning::Scene scene(world);
    for (int i = 0; i < 50; ++i) {
      const Vector3d p(surroundings.between(-9, 9), surroundings.between(-9, 9),
                       surroundings.between(-9, -0.1));
      const double margin = surroundings.between(0.0, i % 10 == 0 ? 30.0 : 1.0);
      RC_ASSERT(map.overhead(p, margin) == overheads.is_above(p, robot.radius() + margin));
      const std::optional<double> ground = planning::ground_below(scene, p);
      const std::optional<double> seen = map.ground_below(p);
      RC_ASSERT(is_alike(ground, seen) || is_at_an_edge(scene, p));
    }
  }
}

TEST(MapView, AnswersByTheNewestSnapshot) {
  const planning::World nothing;
  const planning::RobotHull robot = hull();
  MapView map(nothing, robot, 2.5);
  ObservedMap observed;
  const auto change = [&](planning::CellKey key, std::vector<planning::Polytope> pieces) {
    const Utime utime = observed.revision() + 1;
    EXPECT_TRUE(
        observed.apply({planning::ObstacleSource::kMapper, utime, {{key, std::move(pieces)}}}));
  };
  const std::vector<Pose> way = {Pose{{0, 0, -5}}, Pose{{6, 0, -5}}};
  EXPECT_FALSE(map.has_observed());
  EXPECT_FALSE(map.update(observed)) << "nothing is observed";
  EXPECT_EQ(map.clearance(way), std::numeric_limits<double>::infinity());
  change(7, {polytope_of({{1, 1, 1}, Pose{{3, 2, -5}}})});
  EXPECT_EQ(map.clearance(way), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(map.update(observed));
  EXPECT_FALSE(map.update(observed)) << "it is the same";
  EXPECT_TRUE(map.has_observed());
  EXPECT_NEAR(map.clearance(way), 1.3, 0.01);
  change(8, {polytope_of({{1, 1, 1}, Pose{{3, -4, -5}}})});
  change(7, {});
  EXPECT_TRUE(map.update(observed));
  EXPECT_EQ(map.clearance(way), 2.5) << "all that is left is farther away";
  EXPECT_TRUE(map.has_observed());
}

TEST(MapView, AnObjectThatIsGoneIsNoObstacleUntilItIsBack) {
  planning::World known;
  known.obstacles.push_back({"floor", planning::HalfSpace{Vector3d::UnitZ()}, Pose{{0, 0, -9}}});
  known.obstacles.push_back({"block", planning::Box{{1, 1, 1}}, Pose{{3, 0, -5}}});
  const planning::RobotHull robot = hull();
  MapView map(known, robot, 2.5);
  const std::vector<Pose> way = {Pose{{0, 0, -5}}, Pose{{6, 0, -5}}};
  const Vector3d below(3, 0, -7);
  const Vector3d above(3, 0, -3);
  ObservedMap observed;
  const auto change = [&](bool is_absent) {
    ASSERT_TRUE(observed.apply({planning::ObstacleSource::kAbsence,
                                observed.revision() + 1,
                                {},
                                {{1, 1, is_absent, 6, 0.5}}}));
    ASSERT_TRUE(map.update(observed));
  };
  EXPECT_LT(map.clearance_to_all(way), 0.0);
  change(true);
  EXPECT_GT(map.clearance_to_all(way), 2.4);
  EXPECT_EQ(map.clearance(way), std::numeric_limits<double>::infinity());
  EXPECT_FALSE(map.overhead(below, 0.0));
  EXPECT_NEAR(map.ground_below(above).value_or(0.0), -9.0, 0.01);
  change(false);
  EXPECT_LT(map.clearance_to_all(way), 0.0);
  EXPECT_LE(map.clearance(way), 0.0) << "the path was certified while the block was gone";
  EXPECT_TRUE(map.overhead(below, 0.0));
  EXPECT_NEAR(map.ground_below(above).value_or(0.0), -4.5, 0.01);
  change(true);
  EXPECT_EQ(map.clearance(way), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace dive::mission
