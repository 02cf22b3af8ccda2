// The rules about a mission in its world, at analytically known limits.

#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "mission/check/rules.h"
#include "mission/executive/machine.h"
#include "test/mission/check/brick.h"

namespace dive::mission {
namespace {

using testing::brick;

// A wall whose face is the plane x = 10, and a seabed at z = -20.
planning::World wall_and_seabed() {
  planning::World world;
  Pose wall;
  wall.p = {11.0, 0.0, -10.0};
  world.obstacles.push_back({"wall", planning::Box{Eigen::Vector3d(2.0, 40.0, 40.0)}, wall});
  Pose seabed;
  seabed.p = {0.0, 0.0, -20.0};
  world.obstacles.push_back({"seabed", planning::HalfSpace{Eigen::Vector3d::UnitZ()}, seabed});
  return world;
}

struct Leg {
  double x = 0.0;
  std::string heading;  ///< As written, or empty.
  std::string attitude = "horizontal";
  double timeout = 300.0;
  double z = 5.0;
  std::string z_units = "DEPTH";
};

std::vector<std::string> codes(const Leg& leg) {
  const std::string heading =
      leg.heading.empty() ? "" : fmt::format(" heading_deg=\"{}\"", leg.heading);
  const std::string text = fmt::format(
      "<mission xmlns=\"urn:dive:mission:1\" id=\"m\">"
      "<vehicle model=\"aqua2\" speed=\"0.5\" attitude=\"{}\"/><map file=\"maps/window.sdf\"/>"
      "<start x=\"-10\" y=\"0\" z=\"5\" z_units=\"DEPTH\" heading_deg=\"90\"/>"
      "<limits max_depth=\"19\" min_altitude=\"2\" clearance=\"0.6\" mission_timeout=\"900\""
      " battery_reserve=\"0.2\"/><states initial=\"a\"><goto id=\"a\" x=\"{}\" y=\"0\" z=\"{}\""
      " z_units=\"{}\"{} capture_radius=\"0.5\" timeout=\"{}\" on_timeout=\"up\">"
      "<transition event=\"done.state.a\" target=\"up\"/></goto><surface id=\"up\">"
      "<transition event=\"done.state.up\" target=\"end\"/></surface><final id=\"end\"/></states>"
      "</mission>",
      leg.attitude, leg.x, leg.z, leg.z_units, heading, leg.timeout);
  Diagnostics diagnostics;
  const std::optional<Mission> mission =
      parse_mission(SourceText(DIVE_SOURCE_DIR "/missions/window.xml", text), diagnostics);
  EXPECT_TRUE(mission);
  if (mission) check_against_world(*mission, wall_and_seabed(), brick(), diagnostics);
  std::vector<std::string> found;
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    EXPECT_GT(diagnostic.span.column, 0);
    found.push_back(diagnostic.code);
  }
  return found;
}

using Codes = std::vector<std::string>;
const Codes kNone;
const Codes kClearance = {"CHK-CLEARANCE"};
const Codes kInside = {"CHK-INSIDE"};

TEST(PositionsAreClear, MeasuresTheHullAtItsHeading) {
  // Facing the wall: half a metre of vehicle and 0.6 m of clearance before x = 10.
  EXPECT_EQ(codes({8.89, "90"}), kNone);
  EXPECT_EQ(codes({8.91, "90"}), kClearance);
  EXPECT_EQ(codes({9.49, "90"}), kClearance);
  EXPECT_EQ(codes({9.51, "90"}), kInside);
  // Along the wall: 0.2 m of vehicle.
  EXPECT_EQ(codes({9.19, "0"}), kNone);
  EXPECT_EQ(codes({9.21, "180"}), kClearance);
  EXPECT_EQ(codes({9.81, "0"}), kInside);
  // At an oblique heading.
  const double reach = 0.5 * std::cos(0.5235987755982988) + 0.2 * std::sin(0.5235987755982988);
  EXPECT_EQ(codes({10.0 - 0.6 - reach - 0.01, "60"}), kNone);
  EXPECT_EQ(codes({10.0 - 0.6 - reach + 0.01, "60"}), kClearance);
}

TEST(PositionsAreClear, TakesTheBestHeadingWhereItIsOpen) {
  EXPECT_EQ(codes({9.19, ""}), kNone);
  EXPECT_EQ(codes({9.25, ""}), kClearance);
}

// Rolled on its side a vehicle may come nearer than a level one: only its centre is certain.
TEST(PositionsAreClear, EvaluatesAFreeAttitudeByTheCentre) {
  EXPECT_EQ(codes({9.25, "", "free"}), kNone);
  EXPECT_EQ(codes({9.45, "", "free"}), kClearance);
  EXPECT_EQ(codes({10.05, "", "free"}), kInside);
  EXPECT_EQ(codes({9.21, "180", "free"}), kClearance) << "a heading asks for a level pose";
}

TEST(PositionsKeepAltitude, CountsFromTheSeabed) {
  EXPECT_EQ(codes({0.0, "", "horizontal", 300.0, 17.9}), kNone);
  EXPECT_EQ(codes({0.0, "", "horizontal", 300.0, 18.1}), Codes({"CHK-ALTITUDE"}));
  EXPECT_EQ(codes({0.0, "", "horizontal", 300.0, 2.1, "ALTITUDE"}), kNone);
  EXPECT_EQ(codes({0.0, "", "horizontal", 300.0, 20.1, "ALTITUDE"}), Codes({"CHK-ABOVE-SURFACE"}));
  // Deeper than max_depth, nearer to the ground than min_altitude, and the hull too near as well.
  EXPECT_EQ(codes({0.0, "", "horizontal", 300.0, 0.65, "ALTITUDE"}).size(), 3U);
}

// From x = -10 to x = 0 less the capture radius: 9.5 m at 0.5 m/s.
TEST(LegsFitTheirTimeouts, InAStraightLine) {
  EXPECT_EQ(codes({0.0, "", "horizontal", 19.1}), kNone);
  EXPECT_EQ(codes({0.0, "", "horizontal", 18.9}), Codes({"CHK-TIMEOUT"}));
}

}  // namespace
}  // namespace dive::mission
