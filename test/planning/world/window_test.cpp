// The Window environment meets the requirements of the paper's experiment.

#include <algorithm>

#include <gtest/gtest.h>

#include "planning/world/overhead.h"
#include "planning/world/scene.h"
#include "planning/world/sdf.h"
#include "test/planning/reference.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

World window() {
  Diagnostics diagnostics;
  auto world = load_sdf(DIVE_SOURCE_DIR "/missions/maps/window.sdf", diagnostics);
  for (const Diagnostic& d : diagnostics.list()) ADD_FAILURE() << render(d, false);
  return world.value_or(World{});
}

std::vector<Vector3d> vehicle_at(const Vector3d& p) {
  auto points = testing::box_corners({0.80, 0.48, 0.22});
  for (Vector3d& v : points) v += p;
  return points;
}

TEST(Window, IsNineBoxesWithNamesForPeople) {
  const World world = window();
  ASSERT_EQ(world.obstacles.size(), 9U);
  const auto named = [&](const std::string& name) {
    return std::any_of(world.obstacles.begin(), world.obstacles.end(),
                       [&](const Obstacle& o) { return o.name == name; });
  };
  EXPECT_TRUE(named("seabed/ground/collision"));
  EXPECT_TRUE(named("rooms/wall_dividing/jamb_south"));
}

TEST(Window, TheStraightLineToTheFarRoomRunsIntoTheDividingWall) {
  const World world = window();
  Scene scene(world);
  const Vector3d gate(-1.0, -2.0, -4.0);
  const Vector3d far_room(9.8, -2.0, -4.6);
  auto sweep = vehicle_at(gate);
  for (const Vector3d& v : vehicle_at(far_room)) sweep.push_back(v);
  std::vector<Contact> contacts;
  scene.contacts(sweep, 0.0, contacts);
  ASSERT_EQ(contacts.size(), 1U);
  const auto hit = static_cast<std::size_t>(contacts[0].obstacle);
  EXPECT_EQ(world.obstacles[hit].name, "rooms/wall_dividing/jamb_south");
}

// Viewed from the west, the opening is where the map's comment states, and nowhere else.
TEST(Window, TheOnlyPassageBetweenTheRoomsIsTheWindow) {
  Scene scene(window());
  for (double y = -3.95; y < 4.0; y += 0.1) {
    for (double z = -6.95; z < -2.0; z += 0.1) {
      const bool open = y > 0.6 && y < 3.6 && z > -6.0 && z < -3.2;
      EXPECT_EQ(scene.point_distance({6.15, y, z}) > 0.0, open) << y << " " << z;
    }
  }
}

TEST(Window, HasClearanceOfAMetreOnEverySide) {
  Scene scene(window());
  for (const Vector3d& p :
       {Vector3d(6.15, 2.1, -4.6), Vector3d(-4.0, -2.0, -3.0), Vector3d(-1.0, -2.0, -4.0),
        Vector3d(9.8, -2.0, -4.6), Vector3d(-3.0, -2.0, -4.0)}) {
    EXPECT_GT(scene.clearance(vehicle_at(p), 5.0), 1.0) << p.transpose();
  }
}

TEST(Window, HasAnOverheadOverTheRoomsAndOpenWaterOutside) {
  const World world = window();
  OverheadIndex overheads(world);
  EXPECT_TRUE(overheads.is_above({1.0, 0.0, -4.0}, 0.5));
  EXPECT_TRUE(overheads.is_above({9.8, -2.0, -4.6}, 0.5));
  EXPECT_FALSE(overheads.is_above({-4.0, -2.0, -3.0}, 0.5));
  EXPECT_FALSE(overheads.is_above({-3.0, -2.0, -4.0}, 0.5));
  EXPECT_FALSE(overheads.is_above({5.0, 0.0, -1.0}, 0.5));  // Above the overhead.
}

}  // namespace
}  // namespace dive::planning
