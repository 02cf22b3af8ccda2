// Every place where a mission has a position takes it as latitude and longitude, and every heading
// may be magnetic.

#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/document/mission.h"
#include "mission/document/state_index.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {
namespace {

// Of latitude 44.651, longitude -63.569 from latitude 44.65, longitude -63.57: computed by the
// closed formulae of test/common/geodesy_test.cpp, in another language.
constexpr double kEast = 79.324019;
constexpr double kNorth = 111.125434;
const std::string kThere = "latitude=\"44.651\" longitude=\"-63.569\"";

std::optional<Mission> parse(const std::string& origin, const std::string& parts,
                             const std::string& state) {
  Diagnostics diagnostics;
  const std::string text = fmt::format(
      "<mission xmlns=\"urn:dive:mission:1\" id=\"m\">{}\n<vehicle model=\"aqua2\" speed=\"0.4\"/>"
      "<map file=\"maps/window.sdf\"/>\n<start {} z=\"1\" z_units=\"DEPTH\" heading_deg=\"350\"/>\n"
      "<limits max_depth=\"100\" min_altitude=\"0\" clearance=\"0.6\" mission_timeout=\"9000\" "
      "battery_reserve=\"0.2\"/>\n{}<states initial=\"a\">\n{}"
      "<surface id=\"up\"><transition event=\"done.state.up\" target=\"end\"/></surface>\n"
      "<final id=\"end\"/></states></mission>\n",
      origin, kThere, parts, state);
  const std::string path = DIVE_SOURCE_DIR "/missions/window.xml";
  std::optional<Mission> mission = parse_mission(SourceText(path, text), diagnostics);
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    if (diagnostic.severity == Severity::kError) ADD_FAILURE() << render(diagnostic, false);
  }
  return mission;
}

std::string state(const std::string& name, const std::string& attributes,
                  const std::string& children = {}) {
  return fmt::format(
      "<{0} id=\"a\" {1} timeout=\"600\" on_timeout=\"up\">{2}<transition "
      "event=\"done.state.a\" target=\"up\"/></{0}>\n",
      name, attributes, children);
}

const std::string kOrigin = "<origin latitude=\"44.65\" longitude=\"-63.57\"/>";
const std::string kDepth = " z=\"3\" z_units=\"DEPTH\"";

void expect_there(const Position& position, double east = kEast, double north = kNorth) {
  EXPECT_NEAR(position.x.value, east, 1e-3);
  EXPECT_NEAR(position.y.value, north, 1e-3);
}

TEST(Geographic, StartAndGoalsTagsAndCorners) {
  const auto mission = parse(
      kOrigin,
      fmt::format("<estimation estimator=\"visual_inertial\"><tag id=\"3\" size=\"0.4\" {0}{1} "
                  "heading_deg=\"0\"/></estimation><failsafes><geofence "
                  "rung=\"abort_and_surface\"><corner {0}/><corner x=\"0\" y=\"500\"/><corner "
                  "x=\"500\" y=\"0\"/></geofence></failsafes>\n",
                  kThere, kDepth),
      state("goal_sequence", "", fmt::format("<goal id=\"g\" {}{}/>", kThere, kDepth)));
  ASSERT_TRUE(mission);
  EXPECT_EQ(mission->origin.value().place.longitude_deg, -63.57);
  expect_there(mission->start);
  expect_there(mission->tags.at(0).position);
  EXPECT_NEAR(mission->failsafes.fence.at(0)[0].value, kEast, 1e-3);
  EXPECT_NEAR(mission->failsafes.fence.at(0)[1].value, kNorth, 1e-3);
  EXPECT_EQ(mission->failsafes.fence.at(1)[1].value, 500.0);
  const Goal& goal = *goals_of(mission->states.at(0)).at(0);
  expect_there(goal.position);
  const Span& span = goal.position.y.span;
  EXPECT_EQ(mission->source.line(span.line).substr(static_cast<std::size_t>(span.column - 1),
                                                   static_cast<std::size_t>(span.length)),
            "44.651")
      << "messages about the position point at what was written";
}

TEST(Geographic, BothEndsOfALegOfATransectAndTheStartOfRows) {
  const auto mission =
      parse(kOrigin, "",
            state("transect", kDepth,
                  fmt::format("<leg from_latitude=\"44.651\" from_longitude=\"-63.569\" to_x=\"1\" "
                              "to_y=\"2\"/><leg from_x=\"1\" from_y=\"2\" to_latitude=\"44.651\" "
                              "to_longitude=\"-63.569\"/><rows {} heading_deg=\"90\" length=\"10\" "
                              "spacing=\"2\" count=\"1\"/>",
                              kThere)));
  ASSERT_TRUE(mission);
  const auto goals = goals_of(mission->states.at(0));
  ASSERT_EQ(goals.size(), 6U);
  expect_there(goals[0]->position);
  expect_there(goals[1]->position, 1.0, 2.0);
  expect_there(goals[3]->position);
  expect_there(goals[4]->position);
  expect_there(goals[5]->position, kEast + 10.0);
}

TEST(Geographic, TheCentreOfAnOrbitAndTheEntryOfAPenetration) {
  const auto orbit =
      parse(kOrigin, "",
            state("orbit", fmt::format("{}{} radius=\"5\" stations=\"4\" first_bearing_deg=\"90\"",
                                       kThere, kDepth)));
  ASSERT_TRUE(orbit);
  expect_there(goals_of(orbit->states.at(0)).at(0)->position, kEast + 5.0);
  const auto wreck =
      parse(kOrigin, "",
            state("wreck_penetration", "max_penetration=\"20\"",
                  fmt::format("<entry {0}{1}/><goal id=\"g\" {0}{1}/>", kThere, kDepth)));
  ASSERT_TRUE(wreck);
  expect_there(goals_of(wreck->states.at(0).children.at(0)).at(0)->position);
}

TEST(Geographic, MagneticHeadingsAreTurnedByTheDeclination) {
  const std::string origin =
      "<origin latitude=\"44.65\" longitude=\"-63.57\" declination_deg=\"15\" headings=\"{}\"/>";
  const std::string orbit = state(
      "orbit",
      fmt::format("{}{} radius=\"5\" stations=\"4\" first_bearing_deg=\"75\"", kThere, kDepth));
  const std::string current = "<current speed=\"0.05\" towards_deg=\"90\"/>";
  const auto magnetic = parse(fmt::format(fmt::runtime(origin), "magnetic"), current, orbit);
  ASSERT_TRUE(magnetic);
  EXPECT_NEAR(magnetic->start_heading_deg, 5.0, 1e-9) << "350 + 15";
  expect_there(goals_of(magnetic->states.at(0)).at(0)->position, kEast + 5.0);
  const auto by_true = parse(fmt::format(fmt::runtime(origin), "true"), current, orbit);
  ASSERT_TRUE(by_true);
  EXPECT_EQ(by_true->start_heading_deg, 350.0);
  // The direction of a current is true in both.
  EXPECT_EQ(magnetic->current.value.at(0.0), by_true->current.value.at(0.0));
}

}  // namespace
}  // namespace dive::mission
