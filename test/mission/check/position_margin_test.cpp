// Margins of planned legs before a wall, against closed forms.

#include "mission/check/position_margin.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/check/check.h"
#include "planning/world/scene.h"
#include "test/mission/check/brick.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

using testing::brick;

// A wall whose face is the plane x = 10, and a seabed at z = -20.
planning::World wall_and_seabed() {
  planning::World world;
  Pose wall;
  wall.p = {11.0, 0.0, -10.0};
  world.obstacles.push_back({"wall", planning::Box{Eigen::Vector3d(2.0, 80.0, 40.0)}, wall});
  Pose seabed;
  seabed.p = {0.0, 0.0, -20.0};
  world.obstacles.push_back({"seabed", planning::HalfSpace{Eigen::Vector3d::UnitZ()}, seabed});
  return world;
}

// From (-10, 0) to (x, 0) at 0.5 m/s, 5 m deep.
struct Swum {
  LegMargin margin;
  std::vector<Pose> path;
  Diagnostics diagnostics;
};

Swum swim_to(double x, const std::string& map, const std::string& current = "",
             const planning::World& world = wall_and_seabed()) {
  const std::string text = fmt::format(
      "<mission xmlns=\"urn:dive:mission:1\" id=\"m\">"
      "<vehicle model=\"aqua2\" speed=\"0.5\" attitude=\"horizontal\"/>"
      "<map file=\"maps/window.sdf\"{}/>{}"
      "<start x=\"-10\" y=\"0\" z=\"5\" z_units=\"DEPTH\" heading_deg=\"90\"/>"
      "<limits max_depth=\"19\" min_altitude=\"2\" clearance=\"0.6\" mission_timeout=\"900\""
      " battery_reserve=\"0.2\"/><states initial=\"a\"><goto id=\"a\" x=\"{}\" y=\"0\" z=\"5\""
      " z_units=\"DEPTH\" heading_deg=\"90\" timeout=\"300\" on_timeout=\"up\">"
      "<transition event=\"done.state.a\" target=\"up\"/></goto><surface id=\"up\">"
      "<transition event=\"done.state.up\" target=\"end\"/></surface><final id=\"end\"/></states>"
      "</mission>",
      map, current, x);
  Swum swum;
  const auto mission = parse_mission({"m.xml", text}, swum.diagnostics, MapFile::kNotNeeded);
  EXPECT_TRUE(mission) << text;
  const planning::Scene scene(world);
  const Route route = nominal_route(*mission, scene);
  auto legs = plan_route(route, *mission, world, brick(), {}, 1);
  vehicle::Model vehicle;
  vehicle.hull = brick();
  predict_position_margins(route, legs, *mission, world, vehicle);
  check_dead_reckoning(route, legs, *mission, world, vehicle.hull, swum.diagnostics);
  check_position_margins(route, legs, *mission, swum.diagnostics);
  EXPECT_EQ(legs.size(), 1U);
  swum.margin = legs.at(0).margin;
  swum.path = legs.at(0).plan.waypoints;
  return swum;
}

TEST(PositionMargin, OfDeadReckoningIsThatOfItsClosedForm) {
  const Swum swum = swim_to(8.0, " fixes=\"off\"");
  const double scale = 0.08 * 18.0;  // along the way
  const double drift = 0.02 * 36.0;  // by the current that is not known
  const double sigma =
      std::sqrt(0.1 * 0.1 + 0.05 * 0.05 + scale * scale + drift * drift + 0.03 * 0.03 * 36.0);
  EXPECT_NEAR(swum.margin.end_sigma_m, sigma, 0.01);
  EXPECT_EQ(swum.margin.obstacle_name, "wall");
  EXPECT_NEAR(swum.margin.clearance_m, 1.5, 0.02) << "from the bow to the wall";
  EXPECT_NEAR(swum.margin.margin_sigma, (1.5 - 0.1) / sigma, 0.02);
  ASSERT_FALSE(swum.diagnostics.ok());
  EXPECT_EQ(swum.diagnostics.list().at(0).code, "CHK-MARGIN");
  EXPECT_THAT(swum.diagnostics.list().at(0).message, HasSubstr("passes wall at 1.5"));
  EXPECT_THAT(swum.diagnostics.list().at(0).hint, HasSubstr("range camera"));
}

TEST(PositionMargin, DeadReckoningUnderAnOverheadIsRefusedUnlessTheWaterIsStill) {
  planning::World roofed = wall_and_seabed();
  Pose roof;
  roof.p = {-4.0, 0.0, -2.0};
  roofed.obstacles.push_back({"roof", planning::Box{Eigen::Vector3d(4.0, 8.0, 0.2)}, roof});
  const auto is_refused = [&](const std::string& map, const std::string& current,
                              const planning::World& world) {
    const Swum swum = swim_to(0.0, map, current, world);
    return std::ranges::any_of(swum.diagnostics.list(),
                               [](const auto& each) { return each.code == "CHK-NO-FIXES"; });
  };
  const std::string off = " fixes=\"off\"";
  EXPECT_TRUE(is_refused(off, "", roofed));
  EXPECT_TRUE(is_refused(off, "<current speed=\"0.05\" towards_deg=\"0\" sigma=\"0\"/>", roofed));
  EXPECT_FALSE(is_refused(off, "<current sigma=\"0\"/>", roofed));
  EXPECT_FALSE(is_refused(off, "", wall_and_seabed()));
  EXPECT_FALSE(is_refused("", "", roofed));
}

TEST(PositionMargin, AFixConstrainsThePositionTowardsWhatItShows) {
  const Swum swum = swim_to(8.0, "");
  EXPECT_TRUE(swum.diagnostics.ok());
  EXPECT_EQ(swum.margin.obstacle_name, "wall");
  EXPECT_LT(swum.margin.sigma_m, 0.08) << "the wall is in view";
  EXPECT_GT(swum.margin.end_sigma_m, 0.3) << "along the wall nothing is";
  EXPECT_GT(swum.margin.margin_sigma, kSafeMargin);
}

// A long smooth block in the way over a bare seabed: nearer past its south side, where nothing else
// is; past its north side there is a row of pipes.
planning::World two_passages() {
  planning::World world;
  Pose block;
  block.p = {5.0, 0.5, -10.0};
  world.obstacles.push_back({"block", planning::Box{Eigen::Vector3d(18.0, 4.0, 40.0)}, block});
  for (int i = 0; i < 6; ++i) {
    Pose pipe;
    pipe.p = {-4.0 + 3.5 * i, 6.5, -10.0};
    world.obstacles.push_back({fmt::format("pipe_{}", i), planning::Cylinder{0.2, 40.0}, pipe});
  }
  Pose seabed;
  seabed.p = {0.0, 0.0, -8.0};
  world.obstacles.push_back({"seabed", planning::HalfSpace{Eigen::Vector3d::UnitZ()}, seabed});
  return world;
}

TEST(PositionMargin, IsLargerByThePassageThatTheMissionPrefersForItsInformation) {
  const planning::World world = two_passages();
  const auto side = [](const Swum& swum) {
    double widest = 0.0;
    for (const Pose& pose : swum.path) {
      if (std::abs(pose.p.y()) > std::abs(widest)) widest = pose.p.y();
    }
    return widest;
  };
  const Swum shortest = swim_to(20.0, "", "", world);
  const Swum preferred = swim_to(20.0, " information=\"prefer\"", "", world);
  EXPECT_LT(side(shortest), -1.5);
  EXPECT_GT(side(preferred), 2.5);
  EXPECT_LT(preferred.margin.end_sigma_m, 0.5 * shortest.margin.end_sigma_m);
  EXPECT_GT(preferred.margin.margin_sigma, shortest.margin.margin_sigma);
}

TEST(PositionMargin, FarFromEverythingThereIsNone) {
  const Swum swum = swim_to(0.0, " fixes=\"off\"");
  EXPECT_TRUE(std::isinf(swum.margin.margin_sigma));
  EXPECT_TRUE(swum.diagnostics.list().empty());
}

TEST(PositionMargin, IsThatOfMissionsWhosePositionIsPredictable) {
  Diagnostics diagnostics;
  const auto mission = [&](const std::string& path) {
    auto loaded = load_mission(fmt::format("{}/missions/{}", DIVE_SOURCE_DIR, path), diagnostics);
    EXPECT_TRUE(loaded);
    return *std::move(loaded);
  };
  EXPECT_TRUE(has_position_margins(mission("window.xml")));
  EXPECT_FALSE(has_position_margins(mission("cluttered_unknown.xml")));
  EXPECT_TRUE(has_position_margins(mission("pool_visual_inertial.xml")));
  EXPECT_FALSE(has_position_margins(mission("laps_visual_inertial.xml")));
}

}  // namespace
}  // namespace dive::mission
