// Objects of the map that are not where it has them, by scans of places that differ from it.

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "planning/map_matching/absence_tracker.h"
#include "planning/map_matching/map_matcher.h"
#include "planning/map_matching/object_cells.h"
#include "planning/map_matching/object_scan.h"
#include "planning/world/observed_map.h"
#include "test/planning/map_matching/place.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::Place;

const Pose kHere{{0.0, 0.0, -2.0}, {1, 0, 0, 0}};

// A wall 7 m away, and a thin upright pipe before it.
Place with_pipe() {
  return {-4.0,
          {{{7.0, 0.0, -2.0}, {0.2, 14.0, 4.0}, 0.0}, {{4.0, 0.3, -2.0}, {0.1, 0.1, 4.0}, 0.0}}};
}
Place without_pipe() {
  Place place = with_pipe();
  place.boxes.pop_back();
  return place;
}

struct Known {
  explicit Known(const World& world) : surface(world), objects(world, surface) {}
  explicit Known(const Place& place) : Known(place.map()) {}

  [[nodiscard]] std::vector<CellSighting> seen(const Place& truth, const Pose& X_WB,
                                               const Vector3d& error = Vector3d::Zero(),
                                               double sigma_m = 0.03) const {
    Random random(5);
    RangeScan scan = truth.scan(X_WB, random, 0.01, 100, 75);
    return observe_objects(surface, objects, scan, Pose{X_WB.p + error, X_WB.q}, sigma_m);
  }

  MapSurface surface;
  ObjectCells objects;
};

int count(const std::vector<CellSighting>& sightings, bool is_free) {
  return static_cast<int>(std::ranges::count(sightings, is_free, &CellSighting::is_free));
}

TEST(ObjectCells, LeavesOutTheGroundAndWhatIsTooLargeToBeMissing) {
  World world = with_pipe().map();  // a floor, a wall of 14 m, a pipe
  world.obstacles.push_back({"tile", Box{{3.0, 2.0, 0.4}}, Pose{{0, 0, -3.8}}});
  world.obstacles.push_back({"ball", Sphere{0.5}, Pose{{2, 2, -2}}});
  const Known known(world);
  ASSERT_EQ(known.objects.objects().size(), 2u);
  EXPECT_EQ(known.objects.objects()[0].obstacles.first, 2) << "the pipe";
  EXPECT_EQ(known.objects.objects()[1].obstacles.first, 4) << "the ball";
  EXPECT_EQ(known.objects.objects()[0].cells.size(), 8u) << "4 m of a thin pipe";
}

TEST(ObjectCells, TheirBoxesCoverTheSurface) {
  World world;
  world.obstacles.push_back({"ball", Sphere{0.8}, Pose{{2, 2, -2}}});
  const Known known(world);
  const ObjectCells::Object& ball = known.objects.objects().front();
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const Vector3d normal =
        Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    const Vector3d p_W = Vector3d(2, 2, -2) + 0.8 * normal;
    EXPECT_TRUE(ball.cell_at(p_W));
    EXPECT_TRUE(std::ranges::any_of(
        ball.cells, [&](const Eigen::AlignedBox3d& cell) { return cell.contains(p_W); }));
  }
}

TEST(ObjectScan, SeesThroughAPipeThatIsGoneExceptCloseToTheFloor) {
  const Known known(with_pipe());
  const auto sightings = known.seen(without_pipe(), kHere);
  EXPECT_GE(count(sightings, true), 2) << "the view ends 8 degrees below the horizon";
  EXPECT_EQ(count(sightings, false), 0);
  for (const CellSighting& one : sightings) {
    EXPECT_GE(one.cell, 1) << "the floor is nearer than a tolerance to the lowest cell";
  }
}

TEST(ObjectScan, MeetsAPipeThatIsThere) {
  const Known known(with_pipe());
  const auto sightings = known.seen(with_pipe(), kHere);
  EXPECT_EQ(count(sightings, true), 0);
  EXPECT_GE(count(sightings, false), 2);
}

// The estimate may be off by two sigmas, far more than the pipe is thick, and the pipe by 2 cm.
RC_GTEST_PROP(ObjectScan, NeverSeesThroughAPipeThatIsThere, ()) {
  const Known known(with_pipe());
  const auto between = [](int low, int high) { return 0.01 * *rc::gen::inRange(low, high + 1); };
  const double angle = between(0, 628);
  const double error = between(0, 20);
  Place truth = with_pipe();
  truth.boxes[1].centre += Vector3d(between(-2, 2), between(-2, 2), 0.0);
  const Pose X_WB{{between(-100, 200), between(-150, 150), between(-250, -100)},
                  from_rpy(between(-5, 5), between(-5, 10), between(-30, 30))};
  const auto sightings =
      known.seen(truth, X_WB, error * Vector3d(std::cos(angle), std::sin(angle), 0.0), 0.1);
  RC_ASSERT(count(sightings, true) == 0);
}

TEST(ObjectScan, ARayWithoutAReturnProvesNothing) {
  const Known known(with_pipe());
  Place open = without_pipe();
  open.boxes.clear();
  open.floor_z = -40.0;
  EXPECT_TRUE(known.seen(open, kHere).empty());
}

TEST(MatchedScan, OnlyAGoodPositionThatTheSceneConfirmsMayShowAbsence) {
  Place room = with_pipe();
  room.boxes.push_back({{3.0, 3.5, -2.0}, {6.0, 0.2, 4.0}, 0.0});
  const MapMatcher matcher(room.map());
  std::erase_if(room.boxes, [](const testing::UprightBox& box) { return box.size.y() == 0.1; });
  Random random(4);
  PosePrior prior;
  prior.X_WB = kHere;
  prior.covariance.diagonal() << 0.01, 0.01, 1e-4;
  const RangeScan scan = room.scan(kHere, random);
  PlaceSearch here;
  EXPECT_TRUE(matcher.place(scan, prior, here).may_show_absence());
  // Along the wall alone the position is as uncertain as before.
  Place wall = without_pipe();
  const MapMatcher along(wall.map());
  prior.covariance.diagonal() << 0.09, 0.09, 1e-4;
  PlaceSearch beside_wall;
  EXPECT_FALSE(along.place(wall.scan(kHere, random), prior, beside_wall).may_show_absence());
  // Another place.
  const Place elsewhere{-6.0, {{{2.5, 1.0, -3.0}, {0.5, 1.0, 4.0}, 0.8}}};
  prior.covariance.diagonal() << 0.01, 0.01, 1e-4;
  EXPECT_FALSE(matcher.place(elsewhere.scan(kHere, random), prior, here).may_show_absence());
}

// One object of ten cells.
class AbsenceTrackerTest : public ::testing::Test {
 protected:
  static constexpr int kCells = 10;

  AbsenceTrackerTest() {
    World world;
    world.obstacles.push_back({"floor", HalfSpace{Vector3d::UnitZ()}, {}});
    world.obstacles.push_back({"mast", Box{{0.1, 0.1, 5.0}}, Pose{{4, 0, -3}}});
    const MapSurface surface(world);
    tracker_ =
        std::make_unique<AbsenceTracker>(std::make_shared<const ObjectCells>(world, surface));
  }

  // A scan that shows the first `free` cells free, and `occupied` (if not negative) occupied.
  void scan(double x, int free, int occupied = -1) {
    std::vector<CellSighting> sightings;
    for (int cell = 0; cell < kCells; ++cell) {
      if (cell < free || cell == occupied) sightings.push_back({0, cell, cell != occupied});
    }
    utime_ += 500'000;
    const auto update = tracker_->add(utime_, {x, 0.0, -2.0}, sightings);
    if (!update) return;
    EXPECT_TRUE(is_well_formed(*update));
    EXPECT_TRUE(map_.apply(*update));
    changes_.insert(changes_.end(), update->objects.begin(), update->objects.end());
  }
  void scans(int number, int free, double apart = 0.2) {
    for (int i = 0; i < number; ++i) scan(x_ += apart, free);
  }
  [[nodiscard]] bool is_gone() const { return map_.absent().contains(1); }

  std::unique_ptr<AbsenceTracker> tracker_;
  ObservedMap map_;
  std::vector<ObjectChange> changes_;
  Utime utime_ = 0;
  double x_ = 0.0;
};

TEST_F(AbsenceTrackerTest, GoneAfterSixScansFromThreePlaces) {
  scans(6, 8);  // 1 m: the third place is at 1.2 m
  EXPECT_FALSE(is_gone());
  scans(1, 8);
  EXPECT_TRUE(is_gone());
  ASSERT_EQ(changes_.size(), 1u);
  EXPECT_EQ(changes_[0].scans, 7);
  EXPECT_DOUBLE_EQ(changes_[0].seen_share, 0.8);
}

TEST_F(AbsenceTrackerTest, ManyScansFromOnePlaceAreNotEnough) {
  scans(50, 8, 0.001);
  EXPECT_FALSE(is_gone());
}

TEST_F(AbsenceTrackerTest, ManyPlacesInFewScansAreNotEnough) {
  scans(5, 8, 1.0);
  EXPECT_FALSE(is_gone());
  scans(1, 8, 1.0);
  EXPECT_TRUE(is_gone());
}

TEST_F(AbsenceTrackerTest, SeenInPartItStays) {
  scans(40, 3);
  EXPECT_FALSE(is_gone()) << "30 % of it";
  scans(3, 4);
  EXPECT_TRUE(is_gone()) << "40 %";
}

TEST_F(AbsenceTrackerTest, OneOccupiedPartKeepsAllOfIt) {
  scan(0.0, 0, 9);
  scans(40, 9);
  EXPECT_FALSE(is_gone());
  scans(2, 10);
  EXPECT_FALSE(is_gone()) << "that part is not free yet";
  scans(1, 10);
  EXPECT_TRUE(is_gone()) << "a diver who has swum on";
}

TEST_F(AbsenceTrackerTest, WhatNoScanHasSeenThroughRemainsUntilOneDoes) {
  scans(8, 8);
  ASSERT_TRUE(is_gone());
  EXPECT_EQ(map_.pieces(), 2u);
  int pieces = 0;
  map_.visit({Vector3d(3.9, -0.1, -1.6), Vector3d(4.1, 0.1, -0.4)},
             [&](const ObservedMap::Piece&) { return ++pieces > 0; });
  EXPECT_EQ(pieces, 2) << "its upper end";
  scans(3, 9);
  EXPECT_EQ(map_.pieces(), 1u);
}

TEST_F(AbsenceTrackerTest, ObservedAgainItComesBackAndItsEvidenceIsDropped) {
  scans(8, 8);
  ASSERT_TRUE(is_gone());
  scan(x_, 0, 4);
  EXPECT_TRUE(is_gone()) << "one scan may show a fish";
  EXPECT_EQ(map_.pieces(), 2u);
  scan(x_, 0, 4);
  EXPECT_FALSE(is_gone());
  EXPECT_EQ(map_.pieces(), 0u);
  scans(6, 8);
  EXPECT_FALSE(is_gone());
  scans(1, 8);
  EXPECT_TRUE(is_gone());
  ASSERT_EQ(changes_.size(), 3u);
  EXPECT_FALSE(changes_[1].is_absent);
}

TEST(AbsentObjects, KeepsTheObstaclesOfOthers) {
  AbsentObjects absent;
  const std::vector<ObjectChange> gone = {{2, 3, true}, {7, 1, true}};
  absent.apply(gone);
  const std::vector<ObjectChange> back = {{2, 3, false}};
  const AbsentObjects before = absent;
  absent.apply(back);
  for (int obstacle = 0; obstacle < 10; ++obstacle) {
    EXPECT_EQ(before.contains(obstacle), (obstacle >= 2 && obstacle < 5) || obstacle == 7);
    EXPECT_EQ(absent.contains(obstacle), obstacle == 7);
  }
  World world;
  for (const char* name : {"0", "1", "2", "3", "4", "5", "6", "7"}) {
    world.obstacles.push_back({name, Sphere{1.0}, {}});
  }
  EXPECT_EQ(without(world, before).obstacles.size(), 4u);
  EXPECT_EQ(without(world, before).obstacles.back().name, "6");
}

TEST(ObstacleUpdate, ObjectsBelongToScansThatSeeThroughThem) {
  ObstacleUpdate update{ObstacleSource::kAbsence, 1, {}, {{2, 3, true}, {5, 1, true}}};
  EXPECT_TRUE(is_well_formed(update));
  update.source = ObstacleSource::kMapper;
  EXPECT_FALSE(is_well_formed(update));
  update.source = ObstacleSource::kAbsence;
  update.objects[1].first = 4;
  EXPECT_FALSE(is_well_formed(update)) << "they overlap";
  update.objects[1] = {5, 2'000'000'000, true};
  EXPECT_FALSE(is_well_formed(update));
  update.objects[1] = {5, 1, true, 4, std::nan("")};
  EXPECT_FALSE(is_well_formed(update));
  update.objects = {{-1, 1, true}};
  EXPECT_FALSE(is_well_formed(update));
  update.objects.clear();
  update.cells = {{kFirstAbsenceKey, {}}};
  EXPECT_TRUE(is_well_formed(update));
  update.source = ObstacleSource::kScript;
  EXPECT_FALSE(is_well_formed(update));
}

}  // namespace
}  // namespace dive::planning
