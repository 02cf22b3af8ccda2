// Overhead, altitude and used resources, compared with the constructed world.

#include "mission/executive/overhead_monitor.h"

#include <gtest/gtest.h>

#include "test/planning/boxes.h"

namespace dive::mission {
namespace {

using Eigen::Vector3d;

// Ground at 10 m, and an overhead over x > 0, 1 m below the surface.
planning::World world() {
  planning::World world;
  world.obstacles.push_back({"ground", planning::Box{{80, 80, 1}}, Pose{{0, 0, -10.5}}});
  world.obstacles.push_back({"roof", planning::Box{{40, 40, 1}}, Pose{{20, 0, -1.5}}});
  return world;
}

planning::RobotHull hull() {
  return {{{"body", dive::testing::box_corners(Vector3d(0.6, 0.4, 0.2))}}};
}

class OverheadMonitorTest : public ::testing::Test {
 protected:
  void SetUp() override {
    mission_.limits.mission_timeout.value = 1100.0;
    mission_.limits.battery_reserve.value = 0.2;
  }

  void update(OverheadMonitor& monitor, double t_s, double x, double battery = 1.0,
              std::optional<bool> declared_overhead = {}) {
    estimation::StateEstimate estimate;
    estimate.X_WB.p = {x, 0.0, -4.0};
    monitor.update(from_seconds(t_s), estimate, declared_overhead, battery);
  }

  Mission mission_;
  planning::World world_ = world();
  planning::RobotHull hull_ = hull();
  MapView map_{world_, hull_};
};

TEST_F(OverheadMonitorTest, FindWhatIsAboveAndBelow) {
  OverheadMonitor monitor(mission_, map_);
  update(monitor, 0.0, -5.0);
  EXPECT_FALSE(monitor.has_overhead());
  EXPECT_TRUE(monitor.open_above());
  ASSERT_TRUE(monitor.altitude_m());
  EXPECT_NEAR(*monitor.altitude_m(), 6.0, 1e-6);
  update(monitor, 1.0, 5.0);
  EXPECT_TRUE(monitor.has_overhead());
  EXPECT_FALSE(monitor.open_above());
  EXPECT_NEAR(monitor.trail().penetration_m(), 10.0, 1e-6);
}

// So near to the edge of the overhead that it may drift below it.
TEST_F(OverheadMonitorTest, BesideAnOverheadThereIsNoVerticalAscent) {
  OverheadMonitor monitor(mission_, map_);
  update(monitor, 0.0, -0.5);
  EXPECT_FALSE(monitor.has_overhead());
  EXPECT_FALSE(monitor.open_above());
}

TEST_F(OverheadMonitorTest, MeasureTheBudgetUsedSinceOpenWater) {
  OverheadMonitor monitor(mission_, map_);
  update(monitor, 100.0, -5.0, 0.8);
  EXPECT_EQ(monitor.budget_used(from_seconds(100.0), 0, 0.8), 0.0);
  update(monitor, 101.0, 5.0, 0.8);
  EXPECT_NEAR(monitor.budget_used(from_seconds(350.0), 0, 0.8), 0.25, 1e-9)
      << "250 s of the 1,000 s that were left";
  EXPECT_NEAR(monitor.budget_used(from_seconds(350.0), 0, 0.5), 0.5, 1e-9)
      << "0.3 of the 0.6 that may be used";
  update(monitor, 400.0, -5.0, 0.5);
  EXPECT_EQ(monitor.budget_used(from_seconds(400.0), 0, 0.5), 0.0) << "out again";
}

TEST_F(OverheadMonitorTest, InAnUnknownEnvironmentUseTheDeclarationsAndStoreTheirPlaces) {
  mission_.unknown.emplace();
  const planning::World nothing;
  MapView empty(nothing, hull_);
  OverheadMonitor monitor(mission_, empty);
  update(monitor, 0.0, -5.0, 1.0, false);
  EXPECT_FALSE(monitor.has_overhead());
  update(monitor, 1.0, 5.0, 1.0, true);
  EXPECT_TRUE(monitor.has_overhead());
  update(monitor, 2.0, 5.0);
  EXPECT_TRUE(monitor.has_overhead()) << "a vehicle that holds there is still below it";
  update(monitor, 3.0, -5.0);
  EXPECT_FALSE(monitor.has_overhead()) << "and one that came back is not";
}

TEST_F(OverheadMonitorTest, GoOnWithTheTrailThatWasLeft) {
  mission_.unknown.emplace();
  const planning::World nothing;
  MapView empty(nothing, hull_);
  OverheadMonitor monitor(mission_, empty);
  monitor.restore(
      std::vector<behaviors::Trail::Breadcrumb>{{{-5, 0, -4}, true}, {{5, 0, -4}, false}});
  update(monitor, 500.0, 5.0, 0.6);
  EXPECT_TRUE(monitor.has_overhead());
  monitor.restore(Usable{from_seconds(100.0), 0.8});
  EXPECT_NEAR(monitor.budget_used(from_seconds(500.0), 0, 0.8), 0.4, 1e-9);
}

}  // namespace
}  // namespace dive::mission
