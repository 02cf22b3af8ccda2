#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/document/mission.h"
#include "mission/document/state_index.h"
#include "mission/import/foreign_mission.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class ImportTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "dive-import-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string file(const std::string& name, const std::string& content) {
    const fs::path path = folder_ / name;
    std::ofstream(path) << content;
    return path.string();
  }
  std::optional<ForeignMission> acfr(const std::string& primitives) {
    return read_acfr(file("m.xml",
                          "<mission>\n<desc> two\n words </desc>\n<global><drop_distance "
                          "m=\"2\"/></global>\n" +
                              primitives + "</mission>\n"),
                     report_);
  }
  std::optional<ForeignMission> qgc(const std::string& content,
                                    std::optional<double> depth_m = std::nullopt) {
    return read_qgc(file("m.plan", content), depth_m, report_);
  }
  // "CODE LINE" of all findings.
  [[nodiscard]] std::vector<std::string> found() const {
    std::vector<std::string> list;
    const Diagnostics diagnostics = report_.diagnostics();
    for (const Diagnostic& d : diagnostics.list()) {
      list.push_back(fmt::format("{} {}", d.code, d.span.line));
    }
    return list;
  }
  // "LINE message hint" of each finding, one per line.
  [[nodiscard]] std::string messages() const {
    std::string all;
    const Diagnostics diagnostics = report_.diagnostics();
    for (const Diagnostic& d : diagnostics.list()) {
      all += fmt::format("{} {} {}\n", d.span.line, d.message, d.hint);
    }
    return all;
  }
  // The result of our own reader.
  std::optional<Mission> ours(ForeignMission foreign, const std::string& id,
                              const ImportOptions& options = {}) {
    foreign.id = id;
    const Imported imported = write_mission(foreign, options, "a--b.xml", report_);
    file(imported.map_name, imported.map_sdf);
    Diagnostics diagnostics;
    const auto mission = load_mission(file(id + ".xml", imported.mission_xml), diagnostics);
    for (const Diagnostic& d : diagnostics.list()) {
      if (d.severity == Severity::kError) ADD_FAILURE() << render(d, false);
    }
    return mission;
  }

  fs::path folder_;
  ImportReport report_;
};

std::string primitive(const std::string& name, const std::string& parts, double timeout = 300,
                      double speed = 0.5, const std::string& mode = "depth") {
  return fmt::format(
      "<primitive><{0}>{1}<timeout t=\"{2}\"/><velocity x=\"{3}\"/><depth "
      "mode=\"{4}\"/></{0}></primitive>\n",
      name, parts, timeout, speed, mode);
}

TEST_F(ImportTest, GotoAndLegTurnNorthAndEastRound) {
  const auto mission =
      acfr(primitive("goto",
                     "<position x=\"10\" y=\"3\" z=\"2\"/><heading deg=\"0\"/><command "
                     "device=\"camera\" onoff=\"start\"/>") +
           primitive("leg",
                     "<position x=\"10\" y=\"3\" z=\"0\"/><heading deg=\"90\"/><length m=\"20\"/>",
                     300, 0.5, "altitude"));
  ASSERT_TRUE(mission);
  EXPECT_EQ(mission->description, "two words");
  ASSERT_EQ(mission->legs.size(), 2U);
  const ForeignLeg& go = mission->legs[0];
  EXPECT_EQ(go.points, std::vector<Eigen::Vector2d>{Eigen::Vector2d(3, 10)}) << "east, north";
  EXPECT_EQ(go.z, 2.0);
  EXPECT_FALSE(go.is_altitude);
  EXPECT_EQ(go.capture_radius, 2.0);
  EXPECT_EQ(go.payload, std::vector<std::string>{"camera_start"});
  const ForeignLeg& leg = mission->legs[1];
  EXPECT_TRUE(leg.is_altitude);
  EXPECT_LT((leg.points[1] - Eigen::Vector2d(23, 10)).norm(), 1e-9) << "90 degrees is east";
  EXPECT_TRUE(ours(*mission, "two"));
}

// More than twenty of ACFR's missions have one as their first primitive, at their origin.
TEST_F(ImportTest, AWaypointWithoutTimeIsTheStartOrIsPassed) {
  const auto stop = [](const char* device) {
    return fmt::format("<command device=\"{}\" onoff=\"stop\"/>", device);
  };
  const auto at = [](int north) {
    return fmt::format("<position x=\"{}\" y=\"3\" z=\"2\"/>", north);
  };
  const auto mission =
      acfr(primitive("goto", at(0) + "<heading deg=\"-90\"/>" + stop("lamp"), 0) +
           primitive("goto", at(90), 0) + primitive("goto", at(10) + stop("camera")) +
           primitive("goto", at(80) + stop("sonar"), 0));
  ASSERT_TRUE(mission);
  ASSERT_EQ(mission->legs.size(), 1U);
  EXPECT_EQ(mission->legs[0].points[0], Eigen::Vector2d(3, 10));
  EXPECT_EQ(mission->legs[0].payload, (std::vector<std::string>{"lamp_stop", "camera_stop"}));
  EXPECT_EQ(mission->payload, std::vector<std::string>{"sonar_stop"});
  EXPECT_THAT(messages(), HasSubstr("the waypoint is where the mission starts"));
  EXPECT_THAT(messages(), HasSubstr("the waypoint is not swum to"));

  const auto imported = ours(*mission, "passed");
  ASSERT_TRUE(imported);
  EXPECT_EQ(imported->start.x.value, 3.0);
  EXPECT_EQ(imported->start_heading_deg, 270.0);

  report_ = {};
  EXPECT_FALSE(acfr(primitive("goto", at(0), 0)));
  EXPECT_THAT(messages(), HasSubstr("no primitive that can be swum"));
}

TEST_F(ImportTest, AZambonieIsMownToStarboardForClockwise) {
  const auto mission = acfr(
      primitive("zambonie",
                "<position x=\"0\" y=\"0\" z=\"2\"/><heading deg=\"0\"/><spacing m=\"5\"/><length "
                "m=\"30\"/><width m=\"10\"/><direction d=\"cw\"/>"));
  ASSERT_TRUE(mission);
  const std::vector<Eigen::Vector2d> expected = {{0, 0}, {0, 30}, {5, 30},
                                                 {5, 0}, {10, 0}, {10, 30}};
  ASSERT_EQ(mission->legs[0].points.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_LT((mission->legs[0].points[i] - expected[i]).norm(), 1e-9) << i;
  }
  EXPECT_TRUE(ours(*mission, "lawn"));
}

TEST_F(ImportTest, AnInwardSpiralIsSwumAndSaidToBeDropped) {
  const auto mission =
      acfr(primitive("inwardspiral",
                     "<position x=\"0\" y=\"0\" z=\"2\"/><heading deg=\"0\"/><spacing "
                     "m=\"2\"/><length m=\"10\"/><width m=\"8\"/><direction d=\"ccw\"/>"));
  ASSERT_TRUE(mission);
  EXPECT_THAT(found(), ::testing::ElementsAre("IMP-PRIMITIVE 5", "IMP-PATTERN 5"));
  EXPECT_THAT(messages(), HasSubstr("ACFR's name for it is 'spiralinward'"));
  const auto& points = mission->legs[0].points;
  ASSERT_EQ(points.size(), 12U);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Eigen::Vector2d way = points[i] - points[i - 1];
    EXPECT_NEAR(std::min(std::abs(way.x()), std::abs(way.y())), 0.0, 1e-9) << "no diagonal";
  }
  EXPECT_LT(points[2].x(), -7.9) << "to port for ccw";
}

TEST_F(ImportTest, DefectsAreFoundAtTheirLines) {
  const auto mission = acfr(primitive("goto", "<position x=\"0\" y=\"0\" z=\"0\"/>") +
                            primitive("goto", "<position x=\"100\" y=\"0\" z=\"0\"/>", 150, 0.5) +
                            primitive("goto", "<position x=\"0\" y=\"0\" z=\"3\"/>", 300, 1.5));
  ASSERT_TRUE(mission);
  report_defects(*mission, report_);
  EXPECT_THAT(found(), ::testing::ElementsAre("IMP-TIMEOUT 6", "IMP-SUBMERGED 7"));
  EXPECT_THAT(messages(), HasSubstr("98 m at 0.5 m/s take 196 s, and the timeout is 150 s"));
  EXPECT_TRUE(report_.ok());
}

TEST_F(ImportTest, WhatCannotBeReadIsRefusedAtItsLine) {
  struct Bad {
    std::string primitives;
    std::string phrase;
  };
  const std::string place = "<position x=\"0\" y=\"0\" z=\"0\"/>";
  for (const Bad& bad : std::vector<Bad>{
           {primitive("gotto", place), "did you mean 'goto'"},
           {primitive("goto", "<position x=\"0\" z=\"0\"/>"), "lacks the attribute 'y'"},
           {primitive("goto", "<position x=\"0\" y=\"east\" z=\"0\"/>"), "'east' is not a number"},
           {primitive("goto", "<position x=\"nan\" y=\"0\" z=\"0\"/>"), "'nan' is not a number"},
           {primitive("goto", place, 300, 0.5, "alititude"), "did you mean 'altitude'"},
           {primitive("leg", place + "<heading deg=\"0\"/>"), "lacks a 'length'"},
           {primitive("zambonie", place + "<heading deg=\"0\"/><length m=\"9\"/><width "
                                          "m=\"9\"/><spacing m=\"0\"/>"),
            "cannot be covered"},
           {primitive("zamboni", place), "did you mean 'zambonie'?"},
           {primitive("lawn_mower", place), "ACFR's name for it is 'zambonie'"},
           {primitive("inward_spiral", place), "ACFR's name for it is 'spiralinward'"},
           {primitive("gotoandcircle", place), "it has no counterpart here"},
           {primitive("goto", place, -1), "a timeout of -1 s is negative"},
           {"<primitive><command><command device=\"camera\"/></command></primitive>\n",
            "needs a device, and onoff"},
           {"", "no primitive that can be swum"}}) {
    report_ = {};
    EXPECT_FALSE(acfr(bad.primitives)) << bad.primitives;
    ASSERT_FALSE(report_.ok()) << bad.primitives;
    EXPECT_THAT(messages(), HasSubstr(bad.phrase));
    EXPECT_GT(report_.diagnostics().list().back().span.line, 0);
  }
  EXPECT_FALSE(read_acfr(file("x.xml", "<sdf/>"), report_));
  EXPECT_FALSE(read_acfr(file("x.xml", "<mission"), report_));
  EXPECT_FALSE(read_acfr((folder_ / "none.xml").string(), report_));
}

TEST_F(ImportTest, AWaypointFileIsSwumRelativeToItsFirstWaypoint) {
  const auto mission =
      qgc("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.0\t-122.0\t5\t1\n"
          "1\t0\t3\t16\t0\t0\t0\t0\t47.0\t-122.0\t-2\t1\n"
          "2\t0\t3\t21\t0\t0\t0\t0\t47.0\t-122.0\t-2\t1\n"
          "3\t0\t3\t16\t0\t0\t0\t0\t47.001\t-121.999\t-3\t1\n");
  ASSERT_TRUE(mission);
  EXPECT_THAT(messages(), HasSubstr("command 21 (NAV_LAND)"));
  EXPECT_THAT(messages(),
              HasSubstr("home, at latitude 47 and longitude -122, 5 m high, is left out"));
  ASSERT_EQ(mission->legs.size(), 2U);
  EXPECT_EQ(mission->legs[1].z, 3.0);
  // A thousandth of a degree on WGS 84, computed through earth-centred coordinates.
  EXPECT_NEAR(mission->legs[1].points[0].y(), 111.1713, 1e-3);
  EXPECT_NEAR(mission->legs[1].points[0].x(), 76.0546, 1e-3);
  const auto imported = ours(*mission, "harbour");
  ASSERT_TRUE(imported);
  ASSERT_TRUE(imported->origin);
  EXPECT_EQ(imported->origin->place.latitude_deg, 47.0);
  EXPECT_EQ(imported->origin->place.longitude_deg, -122.0);
}

TEST_F(ImportTest, PositionsFarFromTheOriginOrOffTheEarthAreRefused) {
  EXPECT_FALSE(
      qgc("QGC WPL 110\n1\t0\t3\t16\t0\t0\t0\t0\t47.0\t-122.0\t-2\t1\n"
          "2\t0\t3\t16\t0\t0\t0\t0\t47.0\t122.0\t-2\t1\n"));
  EXPECT_THAT(messages(), HasSubstr("3 the waypoint is more than 20 km from the first waypoint"));
  report_ = {};
  EXPECT_FALSE(qgc(
      "{\"geoFence\": {\"polygons\": [{\"polygon\": [[47, -122], [47.001, -122], [4.7, -122]], "
      "\"inclusion\": true}]}, \"mission\": {\"items\": [\n{\"command\": 16, \"coordinate\": [47, "
      "-122, -2]}]}}"));
  EXPECT_THAT(messages(), HasSubstr("the corner of the geofence at 4.7, -122 is more than 20 km"));
  report_ = {};
  EXPECT_FALSE(acfr("<global><location lat=\"133.8\" lon=\"151.2\"/></global>" +
                    primitive("goto", "<position x=\"10\" y=\"3\" z=\"2\"/>")));
  EXPECT_THAT(messages(), HasSubstr("is not on the earth"));
}

TEST_F(ImportTest, APlanInTheAirNeedsADepth) {
  const std::string plan =
      "{\"mission\": {\"items\": [\n{\"command\": 22, \"coordinate\": [47, -122, 20]},\n"
      "{\"command\": 16, \"coordinate\": [47, -122, 20]},\n{\"command\": 16, \"coordinate\": "
      "[47.001, -122, 20]}]}}";
  EXPECT_FALSE(qgc(plan));
  EXPECT_THAT(messages(), HasSubstr("the waypoint is 20 m above the surface (lines 3, 4)"));
  EXPECT_THAT(found(), ::testing::IsSupersetOf({"IMP-COMMAND 2", "IMP-QGC 3"}));
  report_ = {};
  const auto mission = qgc(plan, 4.0);
  ASSERT_TRUE(mission);
  EXPECT_EQ(mission->legs.at(1).z, 4.0);
  EXPECT_THAT(messages(),
              HasSubstr("becomes a depth of 4 m, as --depth demands: 20 m (lines 3, 4)"));
}

TEST_F(ImportTest, APlanOfTodayHasPlacesAmongItsParametersAndSurveysOfWaypoints) {
  const auto waypoint = [](double latitude) {
    return fmt::format(
        R"({{"command": 16, "params": [0, 0, 0, null, {}, -122, -3], "type": "SimpleItem"}})",
        latitude);
  };
  const auto mission = qgc(
      "{\"mission\": {\"items\": [\n" + waypoint(47.0) +
      ",\n{\"type\": \"ComplexItem\", \"TransectStyleComplexItem\": {\"Items\": [\n" +
      waypoint(47.001) + ",\n{\"command\": 206, \"params\": [1]},\n" + waypoint(47.002) + "]}}]}}");
  ASSERT_TRUE(mission);
  ASSERT_EQ(mission->legs.size(), 3U);
  EXPECT_EQ(mission->legs[2].payload, std::vector<std::string>{"DO_SET_CAM_TRIGG_DIST_1"});
  EXPECT_THAT(messages(), HasSubstr("3 a survey is swum along the waypoints"));
  EXPECT_NEAR(mission->legs[2].points[0].y(), 222.34, 0.02);
  EXPECT_EQ(mission->legs[2].z, 3.0);
}

TEST_F(ImportTest, SurveysInSurveysAreRefusedHoweverDeep) {
  std::string items = "[]";
  for (int i = 0; i < 5000; ++i) {
    items = "[{\"TransectStyleComplexItem\":{\"Items\":" + items + "}}]";
  }
  EXPECT_FALSE(qgc("{\"mission\": {\"items\": " + items + "}}"));
  EXPECT_FALSE(report_.ok());
}

TEST_F(ImportTest, WhatIsNoPlanIsRefused) {
  for (const char* content :
       {"", "{", "[]", "{\"mission\": 3}", "{\"mission\": {\"items\": [{}]}}",
        "{\"mission\": {\"items\": [{\"command\": 16}]}}",
        "{\"mission\": {\"items\": [{\"command\": 16, \"params\": [0, 0, 0, null, 1, null, 2]}]}}",
        "{\"mission\": {\"items\": [{\"TransectStyleComplexItem\": {\"Items\": 3}}]}}",
        "{\"mission\": {\"items\": [{\"command\": 16, \"coordinate\": [200, 0, -1]}]}}",
        "QGC WPL 110\n", "QGC WPL 110\n1 2 3\n"}) {
    report_ = {};
    EXPECT_FALSE(qgc(content)) << content;
    EXPECT_FALSE(report_.ok()) << content;
  }
}

// --- nothing is omitted silently ---

TEST_F(ImportTest, WhatTheFileHasBesidesItsLegsIsCarriedOverOrReported) {
  const auto mission = read_acfr(file("m.xml", R"(<mission>
<location lat="0.000" lon="0.000"/>
<desc>Reef</desc>
<global>
<location lat="-33.839459" lon="151.254380"/>
<turn_radius m="5"/>
<drop_distance m="4"/>
<drop_angle deg="40"/>
<mission_timeout t="1"/>
</global>
<primitive><goto>
<position x="10" y="3" z="-0.1"/>
<Heading deg="-135"/>
<timeout t="0.04"/>
<velocity x="0.5" z="0.1"/>
<depth mode="depth"/>
<command device="camera" onoff="start" freq="2.0"/>
<comand device="dvl"/>
stray
</goto></primitive>
<primitive><command><command device="camera" onoff="stop"/></command></primitive>
<postscript/>
</mission>
)"),
                                 report_);
  ASSERT_TRUE(mission);
  ASSERT_TRUE(mission->origin);
  EXPECT_EQ(mission->origin->latitude_deg, -33.839459);
  ASSERT_EQ(mission->legs.size(), 1U);
  EXPECT_EQ(mission->legs[0].heading_deg, 225.0);
  EXPECT_EQ(mission->legs[0].payload, std::vector<std::string>{"camera_start_freq_2_0"});
  EXPECT_EQ(mission->payload, std::vector<std::string>{"camera_stop"});

  const auto imported = ours(*mission, "reef");
  ASSERT_TRUE(imported);
  EXPECT_EQ(imported->description, "Reef");
  ASSERT_TRUE(imported->origin);
  EXPECT_EQ(imported->origin->place.latitude_deg, -33.839459);
  EXPECT_EQ(imported->origin->place.longitude_deg, 151.25438);
  const StateSpec& leg = imported->states.at(0);
  const Goal& go = *goals_of(leg).at(0);
  EXPECT_EQ(go.heading_deg.value().value, 225.0);
  EXPECT_EQ(go.capture_radius.value, 4.0);
  EXPECT_EQ(leg.timeout.value().seconds.value, 0.1) << "not a minute";
  EXPECT_EQ(imported->states.at(1).on_entry.at(0).text.value, "camera_stop") << "when it surfaces";
  EXPECT_EQ(imported->start_heading_deg, 225.0);

  for (const char* line :
       {"2 'location' lat=\"0.000\" lon=\"0.000\" is left out",
        "5 'location' lat=\"-33.839459\" lon=\"151.254380\" is the origin",
        "6 'turn_radius' m=\"5\" is left out", "8 'drop_angle' deg=\"40\" is left out",
        "9 'mission_timeout' t=\"1\" is left out",
        "12 'position' z=\"-0.1\" is above the surface: it becomes 0",
        "14 'timeout' t may be 0.1 to 86400 s: 0.04 s becomes 0.1 s",
        "15 the attribute z=\"0.1\" of 'velocity' is not understood",
        "17 'command' device=\"camera\" onoff=\"start\" freq=\"2.0\" becomes the payload command "
        "'camera_start_freq_2_0'",
        "18 the element 'comand' in 'goto' is not understood and left out did you mean 'command'?",
        "18 the attribute device=\"dvl\" of 'comand' is not understood",
        "11 the text in 'goto' is not understood",
        "21 ACFR's own software has no primitive 'command'",
        "22 the element 'postscript' in 'mission' is not understood",
        "1 the file has no start: it is put at the first waypoint, x=3 y=10, 1 m deep, heading 225",
        "1 the file has no map: a flat seabed at 5 m is assumed", "1 the file has no limits"}) {
    EXPECT_THAT(messages(), HasSubstr(line));
  }
}

TEST_F(ImportTest, SpeedAndTimeoutsChangeByTheSameRatioOrNotAtAll) {
  const std::string there = "<position x=\"40\" y=\"0\" z=\"2\"/>";
  const std::string back = "<position x=\"0\" y=\"0\" z=\"0\"/>";
  const auto imported = [&](double first, double second, const ImportOptions& options = {}) {
    report_ = {};
    const auto mission =
        acfr(primitive("goto", there, 100, first) + primitive("goto", back, 80, second));
    return ours(mission.value(), "pace", options).value();
  };
  const auto timeout = [](const Mission& mission, std::size_t state) {
    return mission.states.at(state).timeout.value().seconds.value;
  };
  const Mission kept = imported(0.5, 0.5);
  EXPECT_EQ(kept.speed.value, 0.5);
  EXPECT_EQ(timeout(kept, 0), 100.0);
  EXPECT_THAT(messages(), ::testing::Not(HasSubstr("becomes")));

  const Mission slowed = imported(1.0, 1.6);
  EXPECT_EQ(slowed.speed.value, 0.4);
  EXPECT_EQ(timeout(slowed, 0), 250.0);
  EXPECT_EQ(timeout(slowed, 1), 320.0);
  EXPECT_THAT(messages(),
              HasSubstr("5 'velocity' x: 1 m/s becomes 0.4 m/s, because the aqua2 swims at most "
                        "0.8 m/s"));
  EXPECT_THAT(messages(), HasSubstr("5 'timeout' t is multiplied by 2.5, like the duration of its "
                                    "leg: 100 s becomes 250 s"));
  EXPECT_THAT(messages(), HasSubstr("6 'timeout' t is multiplied by 4"));

  const Mission one_of_two = imported(0.5, 1.0);
  EXPECT_EQ(one_of_two.speed.value, 0.5) << "of the slowest leg";
  EXPECT_EQ(timeout(one_of_two, 0), 100.0);
  EXPECT_EQ(timeout(one_of_two, 1), 160.0);

  const Mission demanded = imported(0.5, 0.5, {.speed = 0.2});
  EXPECT_EQ(demanded.speed.value, 0.2);
  EXPECT_EQ(timeout(demanded, 0), 250.0);
  EXPECT_THAT(messages(), HasSubstr("0.5 m/s becomes 0.2 m/s, as --speed demands (lines 5, 6)"));
}

TEST_F(ImportTest, WhatTheVehicleCannotDoIsWarnedOf) {
  const auto mission =
      acfr(primitive("goto", "<position x=\"0\" y=\"0\" z=\"60\"/>", 900, 0.5) +
           primitive("goto", "<position x=\"0\" y=\"0\" z=\"2\"/>", 900, 0.5, "altitude") +
           primitive("goto", "<position x=\"9\" y=\"0\" z=\"0\"/>", 900, 0.0) +
           primitive("goto", "<position x=\"9\" y=\"9\" z=\"0\"/>", 1e6, 0.5));
  ASSERT_TRUE(mission);
  report_defects(*mission, report_);
  EXPECT_TRUE(ours(*mission, "deep"));
  EXPECT_THAT(found(), ::testing::IsSupersetOf(
                           {"IMP-DEPTH 5", "IMP-ALTITUDE 6", "IMP-SPEED 7", "IMP-CHANGED 8"}));
  EXPECT_THAT(messages(), HasSubstr("1000000 s becomes 86400 s"));
}

TEST_F(ImportTest, WhatAPlanHasBesidesItsWaypointsIsCarriedOverOrReported) {
  const auto mission = qgc(R"({"fileType": "Plan",
"geoFence": {"circles": [{"circle": {"radius": 9}}],
 "polygons": [{"inclusion": true, "polygon": [[46.9, -122.1], [47.1, -122.1], [47.1, -121.9]]}]},
"rallyPoints": {"points": [[47, -122, 0]]},
"novelty": 1,
"mission": {"cruiseSpeed": 15, "plannedHomePosition": [47, -122, 3],
"items": [
{"command": 178, "frame": 2, "params": [1, 0.5, -1, 0, 0, 0, 0]},
{"command": 16, "frame": 3, "params": [20, 2, 0, 90, 47, -122, -2]},
{"command": 93, "frame": 2, "params": [5, 0, 0, 0, 0, 0, 0]},
{"command": 2000, "frame": 2, "params": [0, 3, 0, null, null, null, null]},
{"command": 16, "frame": 10, "params": [0, 0, 1, null, 47.001, -122, 4], "autoContinue": false},
{"command": 177, "frame": 2, "params": [2, 5, 0, 0, 0, 0, 0]},
{"command": 2001, "frame": 2, "params": [0, 0, 0, 0, 0, 0, 0]}]}}
)");
  ASSERT_TRUE(mission);
  ASSERT_EQ(mission->legs.size(), 2U);
  EXPECT_EQ(mission->legs[0].dwell_s, 25.0);
  EXPECT_EQ(mission->legs[0].capture_radius, 2.0);
  EXPECT_EQ(mission->legs[0].heading_deg, 90.0);
  EXPECT_EQ(mission->legs[0].speed, 0.5);
  EXPECT_TRUE(mission->legs[1].is_altitude) << "frame 10 is above the ground";
  EXPECT_EQ(mission->legs[1].z, 4.0);
  EXPECT_EQ(mission->legs[1].payload, std::vector<std::string>{"IMAGE_START_CAPTURE_3"});
  EXPECT_EQ(mission->payload, std::vector<std::string>{"IMAGE_STOP_CAPTURE"});
  EXPECT_EQ(mission->fence.size(), 3U);
  const auto imported = ours(*mission, "harbour");
  ASSERT_TRUE(imported);
  EXPECT_EQ(imported->speed.value, 0.5);
  EXPECT_EQ(imported->failsafes.fence.size(), 3U);
  EXPECT_EQ(goals_of(imported->states.at(0)).at(0)->dwell_s.value, 25.0);
  for (const char* line :
       {"1 'fileType' is left out", "2 a circle of the 'geoFence' is left out",
        "4 1 'rallyPoints' are left out", "5 'novelty' is not understood",
        "6 'cruiseSpeed' is left out", "6 'plannedHomePosition' [47,-122,3] is left out",
        "8 param1=1 of command 178 (DO_CHANGE_SPEED) is left out",
        "8 param3=-1 of command 178 (DO_CHANGE_SPEED) is left out",
        "12 param3=1 of command 16 (NAV_WAYPOINT) is left out", "12 the item has no autocontinue",
        "13 command 177 (DO_JUMP) param1=2 param2=5 is left out: each leg is swum once",
        "9 altitudes are above home"}) {
    EXPECT_THAT(messages(), HasSubstr(line));
  }
}

TEST_F(ImportTest, AWaypointFileIsReadToTheEndOfItsLines) {
  const std::string waypoint = "\t3\t16\t0\t0\t0\t0\t47.0\t-122.0\t-2\t1";
  EXPECT_TRUE(qgc("QGC WPL 110\n1\t0" + waypoint + "\tmore\n"));
  EXPECT_THAT(messages(),
              HasSubstr("2 'more' after the 12 numbers of a waypoint is not understood"));
  EXPECT_THAT(messages(), HasSubstr("2 param4=0 of a waypoint, its yaw, is taken as not given"));
  for (const auto& [content, says] : std::vector<std::pair<std::string, std::string>>{
           {"QGC WPL 120\n1\t0" + waypoint, "this version of waypoint files is not known"},
           {"QGC WPL 110\n1\t0\t1\t16\t0\t0\t0\t0\t4\t5\t-2\t1", "the frame 1 gives no latitude"},
           {"QGC WPL 110\n1\t0\t3\t16\t0\t0\t0\t0\t0\t0\t-2\t1", "stand for where the vehicle is"},
           {"QGC WPL 110\n1\t0\t3\t1e99\t0\t0\t0\t0\t4\t5\t-2\t1", "whole numbers"},
           {"{\"mission\":\n {\"items\": [}}", "2 the JSON of the plan is broken here"},
           {"{\"mission\": 1e999}", "a number that is too large"},
           {"{\"mission\": {\"items\": [{\"command\": 4294967312, \"frame\": 3, "
            "\"params\": [0, 0, 0, 0, 4, 5, -2]}]}}",
            "frame and command are whole numbers from 0 to 65535"},
           {"<mission/>", "neither a plan (JSON) nor a waypoint file"}}) {
    report_ = {};
    EXPECT_FALSE(qgc(content)) << content;
    EXPECT_THAT(messages(), HasSubstr(says)) << content;
  }
}

TEST_F(ImportTest, EveryMissionThatTheirVehiclesSwamBecomesOneOfOurs) {
  const fs::path data = fs::path(DIVE_SHARED_DATA) / "missions/acfr";
  if (!fs::exists(data)) GTEST_SKIP() << "the shared data is not here";
  int imported = 0;
  std::map<std::string, int> codes;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    if (entry.path().extension() != ".xml") continue;
    SCOPED_TRACE(entry.path().string());
    report_ = {};
    const auto mission = read_acfr(entry.path().string(), report_);
    if (!mission) {
      ASSERT_FALSE(report_.ok());
      EXPECT_GT(report_.diagnostics().list().front().span.line, 0);
      continue;
    }
    ++imported;
    report_defects(*mission, report_);
    const auto written = ours(*mission, "theirs");
    ASSERT_TRUE(written);
    for (std::size_t i = 0; i < mission->legs.size(); ++i) {
      const ForeignLeg& leg = mission->legs[i];
      const double theirs = *leg.timeout_s * leg.speed.value_or(written->speed.value);
      const double seconds = written->states.at(i).timeout.value().seconds.value;
      EXPECT_NEAR(seconds, std::max(theirs / written->speed.value, 0.1), 1e-3)
          << "metres that a leg has time for";
    }
    const Diagnostics diagnostics = report_.diagnostics();
    for (const Diagnostic& d : diagnostics.list()) ++codes[d.code];
  }
  EXPECT_GT(imported, 200);
  EXPECT_EQ(codes["IMP-UNKNOWN"], 0) << "each of their elements is understood";
  EXPECT_GT(codes["IMP-ORIGIN"], 100);
  EXPECT_GT(codes["IMP-TIMEOUT"], 0);
  EXPECT_GT(codes["IMP-SUBMERGED"], 0);
}

}  // namespace
}  // namespace dive::mission
