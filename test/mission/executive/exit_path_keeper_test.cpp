// Exit paths of a vehicle that swims up to and into a hull with a hatch, compared with the
// constructed world.

#include "mission/executive/exit_path_keeper.h"

#include <cmath>

#include <gtest/gtest.h>

#include "test/planning/boxes.h"
#include "vehicle/going_home.h"

namespace dive::mission {
namespace {

using Eigen::Vector3d;

constexpr double kSigma = 0.02;  // m/s, of the current
constexpr double kLink = 0.48;   // m

// The hull's side at y = 0 and above z = -11, its deck over y > 0 with a hatch of 4 m x 4 m.
planning::World world() {
  planning::World world;
  world.obstacles.push_back({"side", planning::Box{{40, 0.1, 3}}, Pose{{0, 0, -9.5}}});
  world.obstacles.push_back({"deck before", planning::Box{{40, 3, 0.1}}, Pose{{0, 1.5, -8}}});
  world.obstacles.push_back({"deck behind", planning::Box{{40, 30, 0.1}}, Pose{{0, 22, -8}}});
  return world;
}

planning::RobotHull hull() {
  return {{{"body", dive::testing::box_corners(Vector3d(0.6, 0.4, 0.2))}}};
}

class ExitPathKeeperTest : public ::testing::Test {
 protected:
  void SetUp() override { begin(world(), {0.0, -9.0, -12.0}); }

  void begin(planning::World world, const Vector3d& p_W) {
    world_ = std::move(world);
    map_.emplace(world_, hull_);
    keeper_.emplace(ExitPathOptions{.link_m = kLink, .speed = 0.4, .current_sigma = kSigma}, *map_);
    p_W_ = p_W;
  }
  /// Swims along y in a straight line to there.
  void swim(double to_y) {
    constexpr double kStep = 0.05;
    const double from_y = p_W_.y();
    const int steps = std::max(1, static_cast<int>(std::abs(to_y - from_y) / kStep));
    for (int i = 1; i <= steps; ++i) {
      p_W_ = Vector3d(0.0, from_y + (to_y - from_y) * i / steps, p_W_.z());
      update();
    }
  }
  void update() {
    Situation situation;
    situation.estimate.valid = true;
    situation.estimate.X_WB.p = p_W_;
    situation.overhead = map_->overhead(p_W_, 0.0);
    situation.open_above = !map_->overhead(p_W_, 0.2);
    keeper_->update(situation, Vector3d::Zero(), unmodelled_, rung_);
  }
  [[nodiscard]] const std::vector<Pose>& waypoints() const { return keeper_->path().waypoints; }

  planning::World world_;
  planning::RobotHull hull_ = hull();
  std::optional<MapView> map_;
  std::optional<ExitPathKeeper> keeper_;
  Vector3d p_W_;
  estimation::UnmodelledMotion unmodelled_;
  behaviors::Rung rung_ = behaviors::Rung::kNone;
};

TEST_F(ExitPathKeeperTest, MovesWithALoopClosure) {
  swim(-1.2);
  const std::vector<Pose> before = waypoints();
  ASSERT_FALSE(before.empty());
  const std::int64_t revision = keeper_->path().revision;
  const PlanarTransform by{0.1, {0.5, -2.0}};
  keeper_->move({{{0, by}}});
  ASSERT_EQ(waypoints().size(), before.size());
  EXPECT_GT(keeper_->path().revision, revision);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT((waypoints()[i].p - by * before[i].p).norm(), 1e-12);
    EXPECT_LT(angle_between(waypoints()[i].q, (by * before[i]).q), 1e-9);
  }
}

// An ascent from 12 m takes a minute, in which a drift of two sigmas carries the vehicle 3 m.
TEST_F(ExitPathKeeperTest, BesideAHullItLeadsBackToWhereThereIsRoomToDrift) {
  swim(-6.0);
  EXPECT_TRUE(keeper_->path().open_above);
  EXPECT_TRUE(waypoints().empty()) << "there is room";
  EXPECT_EQ(keeper_->path().hold_s, ExitPathKeeper::kHoldInOpenWater);
  swim(-1.2);
  EXPECT_TRUE(keeper_->path().open_above);
  ASSERT_FALSE(waypoints().empty());
  EXPECT_LT(waypoints().back().p.y(), -2.4);
  EXPECT_GT(waypoints().back().p.y(), -4.5) << "no farther than necessary";
  EXPECT_LT(keeper_->path().hold_s, 8.0);
}

TEST_F(ExitPathKeeperTest, UnderAHatchItLeadsOutThereToo) {
  swim(-6.0);
  swim(2.0);
  ASSERT_FALSE(keeper_->path().open_above);
  ASSERT_FALSE(waypoints().empty());
  EXPECT_LT(waypoints().back().p.y(), -2.4);
  swim(5.0);
  ASSERT_TRUE(keeper_->path().open_above) << "the middle of the hatch";
  ASSERT_FALSE(waypoints().empty());
  EXPECT_NEAR(waypoints().front().p.y(), 5.0, 0.6);
  EXPECT_LT(waypoints().back().p.y(), -2.4);
}

// At 40 m along the way the hatch is nearer, and an ascent through it is better than the way back.
TEST_F(ExitPathKeeperTest, ThroughAHatchWhereRoomIsFar) {
  planning::World far = world();
  far.obstacles.back() = {"deck behind", planning::Box{{40, 26, 0.1}}, Pose{{0, 16, -8}}};
  far.obstacles.push_back({"deck end", planning::Box{{40, 10, 0.1}}, Pose{{0, 38, -8}}});
  begin(far, p_W_);
  swim(-6.0);
  swim(31.0);
  ASSERT_TRUE(keeper_->path().open_above);
  EXPECT_TRUE(waypoints().empty());
  swim(36.0);
  ASSERT_FALSE(keeper_->path().open_above);
  EXPECT_NEAR(waypoints().back().p.y(), 31.0, 1.5);
}

// Without room on the trail the last places in open water have to do.
TEST_F(ExitPathKeeperTest, WithoutRoomItAscendsWhereOpenWaterIs) {
  begin(world(), {0.0, -1.5, -12.0});
  swim(-1.2);
  EXPECT_TRUE(keeper_->path().open_above);
  EXPECT_TRUE(waypoints().empty());
  swim(2.0);
  ASSERT_FALSE(waypoints().empty());
  EXPECT_LT(waypoints().back().p.y(), -1.0);
}

TEST_F(ExitPathKeeperTest, InShallowWaterLittleRoomIsEnough) {
  planning::World walled;
  walled.obstacles = {{"wall", planning::Box{{40, 0.1, 8}}, Pose{{0, 0, -4}}}};
  begin(walled, {0.0, -9.0, -3.0});
  swim(-1.6);
  EXPECT_TRUE(waypoints().empty());
  EXPECT_EQ(keeper_->path().hold_s, ExitPathKeeper::kHoldInOpenWater);
}

TEST_F(ExitPathKeeperTest, InACurrentItHoldsNoLongerThanTheClearancePermits) {
  swim(2.0);
  const double drift = 2.0 * std::hypot(kSigma, vehicle::kStopSigma);
  EXPECT_NEAR(keeper_->path().hold_s, kLink / drift, 1e-9);
  unmodelled_.current_W = {0.0, 0.08};
  update();
  EXPECT_NEAR(keeper_->path().hold_s, kLink / 0.08, 1e-9);
  unmodelled_.current_W = {0.0, 0.3};
  update();
  EXPECT_EQ(keeper_->path().hold_s, ExitPathKeeper::kMinHold);
  rung_ = behaviors::Rung::kEmergencySurface;
  update();
  EXPECT_EQ(keeper_->path().hold_s, 0.0);
}

}  // namespace
}  // namespace dive::mission
