#include "mission/simulation/contacts.h"

#include <limits>

#include <gtest/gtest.h>

namespace dive::mission {
namespace {

using Names = std::vector<std::string>;

constexpr Utime kTick = 20'000;

// A cube of 1 m.
planning::RobotHull cube() {
  planning::ConvexSolid solid{"cube", {}};
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      for (const double z : {-0.5, 0.5}) solid.vertices.emplace_back(x, y, z);
    }
  }
  return {{solid}};
}

Pose at(double x, double y, double z) {
  return {Eigen::Vector3d(x, y, z), Eigen::Quaterniond::Identity()};
}

AppearingObstacle crate_at(double x) { return {at(x, 0, -5), Eigen::Vector3d::Ones()}; }

planning::World rock_at(double x) {
  return {{{"rock", planning::Box{Eigen::Vector3d::Ones()}, at(x, 0, -5)}}};
}

TEST(Contacts, NameWhatIsOnTheMapWhatAppearedAndTheDiver) {
  const planning::RobotHull hull = cube();
  vehicle::DiverTrack track;
  track.waypoints = {{{0.0, 10.0, -5.0}, 0.0}};
  Contacts contacts(vehicle::TriangulatedWorld(rock_at(5.0)), hull, track, at(-0.2, 0, 0));
  EXPECT_EQ(contacts.observe(0, at(0, 0, -5)), Names());
  EXPECT_EQ(contacts.nearest().obstacle, "rock");
  EXPECT_NEAR(contacts.nearest().clearance_m, 4.0, 1e-9);
  contacts.add(std::vector{crate_at(-3.0)});
  EXPECT_EQ(contacts.observe(kTick, at(0, 0, -5)), Names());
  EXPECT_EQ(contacts.nearest().obstacle, "obstacle 1");
  EXPECT_NEAR(contacts.nearest().clearance_m, 2.0, 1e-9);
  EXPECT_EQ(contacts.nearest().t_s, 0.02);
  EXPECT_EQ(contacts.observe(2 * kTick, at(4.5, 0, -5)), Names({"rock"}));
  EXPECT_EQ(contacts.nearest().t_s, 0.04);
  EXPECT_EQ(contacts.nearest().p_W, Eigen::Vector3d(4.3, 0, -5)) << "on the map";
  EXPECT_EQ(contacts.observe(3 * kTick, at(-2.5, 0, -5)), Names({"obstacle 1"}));
  EXPECT_NEAR(contacts.diver_clearance_m(), 9.2, 0.02) << "from the cube to the skin";
  EXPECT_EQ(contacts.observe(4 * kTick, at(0, 9.5, -5)), Names({"diver"}));
  EXPECT_EQ(contacts.diver_clearance_m(), 0.0);
  EXPECT_EQ(contacts.nearest().t_s, 0.04) << "nothing is nearer than the first touch";
}

// A new obstacle must not end a contact that persists.
TEST(Contacts, GoOnWhenMoreAppears) {
  const planning::RobotHull hull = cube();
  Contacts contacts(vehicle::TriangulatedWorld(planning::World{}), hull, std::nullopt, {});
  EXPECT_EQ(contacts.diver_clearance_m(), std::numeric_limits<double>::infinity());
  contacts.add(std::vector{crate_at(0.0)});
  EXPECT_EQ(contacts.observe(0, at(0.5, 0, -5)), Names({"obstacle 1"}));
  contacts.add(std::vector{crate_at(1.4), crate_at(9.0)});
  EXPECT_EQ(contacts.observe(kTick, at(0.5, 0, -5)), Names({"obstacle 2"}));
  EXPECT_EQ(contacts.observe(2 * kTick, at(0.5, 0, -5)), Names());
}

}  // namespace
}  // namespace dive::mission
