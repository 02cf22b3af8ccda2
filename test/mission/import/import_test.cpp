#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/document/mission.h"
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
                     diagnostics_, source_);
  }
  std::optional<ForeignMission> qgc(const std::string& content,
                                    std::optional<double> depth_m = std::nullopt) {
    return read_qgc(file("m.plan", content), depth_m, diagnostics_, source_);
  }
  // "CODE LINE" of everything that was found.
  [[nodiscard]] std::vector<std::string> found() const {
    std::vector<std::string> list;
    for (const Diagnostic& d : diagnostics_.list()) {
      list.push_back(fmt::format("{} {}", d.code, d.span.line));
    }
    return list;
  }
  // What our own reader makes of it.
  std::optional<Mission> ours(const ForeignMission& foreign, const std::string& id) {
    ForeignMission named = foreign;
    named.id = id;
    const Imported imported = write_mission(named, {}, "m.xml");
    file(imported.map_name, imported.map_sdf);
    Diagnostics diagnostics;
    const auto mission = load_mission(file(id + ".xml", imported.mission_xml), diagnostics);
    for (const Diagnostic& d : diagnostics.list()) {
      if (d.severity == Severity::kError) ADD_FAILURE() << render(d, false);
    }
    return mission;
  }

  fs::path folder_;
  Diagnostics diagnostics_;
  SourceText source_;
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
  EXPECT_THAT(found(), ::testing::ElementsAre("IMP-PRIMITIVE 5"));
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
  report_defects(*mission, source_, diagnostics_);
  EXPECT_THAT(found(), ::testing::ElementsAre("IMP-TIMEOUT 6", "IMP-SPEED 7", "IMP-SUBMERGED 7"));
  EXPECT_THAT(diagnostics_.list()[0].message, HasSubstr("100 m at 0.5 m/s take 200 s"));
  EXPECT_TRUE(diagnostics_.ok());
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
            "cannot be mown"},
           {"<primitive><command><command device=\"camera\"/></command></primitive>\n",
            "needs a device and an onoff"},
           {"", "no primitive that can be swum"}}) {
    diagnostics_ = {};
    EXPECT_FALSE(acfr(bad.primitives)) << bad.primitives;
    ASSERT_FALSE(diagnostics_.ok()) << bad.primitives;
    std::string all;
    for (const Diagnostic& d : diagnostics_.list()) all += d.message + " " + d.hint + "\n";
    EXPECT_THAT(all, HasSubstr(bad.phrase));
    EXPECT_GT(diagnostics_.list().back().span.line, 0);
  }
  EXPECT_FALSE(read_acfr(file("x.xml", "<sdf/>"), diagnostics_, source_));
  EXPECT_FALSE(read_acfr(file("x.xml", "<mission"), diagnostics_, source_));
  EXPECT_FALSE(read_acfr((folder_ / "none.xml").string(), diagnostics_, source_));
}

TEST_F(ImportTest, AWaypointFileIsSwumRelativeToItsFirstWaypoint) {
  const auto mission =
      qgc("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.0\t-122.0\t5\t1\n"
          "1\t0\t3\t16\t0\t0\t0\t0\t47.0\t-122.0\t-2\t1\n"
          "2\t0\t3\t21\t0\t0\t0\t0\t47.0\t-122.0\t-2\t1\n"
          "3\t0\t3\t16\t0\t0\t0\t0\t47.001\t-121.999\t-3\t1\n");
  ASSERT_TRUE(mission);
  EXPECT_THAT(found(), ::testing::ElementsAre("IMP-PRIMITIVE 4"));
  ASSERT_EQ(mission->legs.size(), 2U);
  EXPECT_EQ(mission->legs[1].z, 3.0);
  EXPECT_NEAR(mission->legs[1].points[0].y(), 111.3, 0.2) << "a thousandth of a degree north";
  EXPECT_NEAR(mission->legs[1].points[0].x(), 75.9, 0.2);
  EXPECT_TRUE(ours(*mission, "harbour"));
}

TEST_F(ImportTest, APlanInTheAirNeedsADepth) {
  const std::string plan =
      "{\"mission\": {\"items\": [\n{\"command\": 22, \"coordinate\": [47, -122, 20]},\n"
      "{\"command\": 16, \"coordinate\": [47, -122, 20]},\n{\"command\": 16, \"coordinate\": "
      "[47.001, -122, 20]}]}}";
  EXPECT_FALSE(qgc(plan));
  EXPECT_THAT(found(), ::testing::ElementsAre("IMP-PRIMITIVE 2", "IMP-QGC 3", "IMP-QGC 4"));
  const auto mission = qgc(plan, 4.0);
  ASSERT_TRUE(mission);
  EXPECT_EQ(mission->legs.at(1).z, 4.0);
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
  EXPECT_THAT(found(), ::testing::ElementsAre("IMP-PRIMITIVE 5")) << "a camera's trigger";
  ASSERT_EQ(mission->legs.size(), 3U);
  EXPECT_NEAR(mission->legs[2].points[0].y(), 222.6, 0.2);
  EXPECT_EQ(mission->legs[2].z, 3.0);
}

TEST_F(ImportTest, SurveysInSurveysAreRefusedHoweverDeep) {
  std::string items = "[]";
  for (int i = 0; i < 5000; ++i) {
    items = "[{\"TransectStyleComplexItem\":{\"Items\":" + items + "}}]";
  }
  EXPECT_FALSE(qgc("{\"mission\": {\"items\": " + items + "}}"));
  EXPECT_FALSE(diagnostics_.ok());
}

TEST_F(ImportTest, WhatIsNoPlanIsRefused) {
  for (const char* content :
       {"", "{", "[]", "{\"mission\": 3}", "{\"mission\": {\"items\": [{}]}}",
        "{\"mission\": {\"items\": [{\"command\": 16}]}}",
        "{\"mission\": {\"items\": [{\"command\": 16, \"params\": [0, 0, 0, null, 1, null, 2]}]}}",
        "{\"mission\": {\"items\": [{\"TransectStyleComplexItem\": {\"Items\": 3}}]}}",
        "{\"mission\": {\"items\": [{\"command\": 16, \"coordinate\": [200, 0, -1]}]}}",
        "QGC WPL 110\n", "QGC WPL 110\n1 2 3\n"}) {
    diagnostics_ = {};
    EXPECT_FALSE(qgc(content)) << content;
    EXPECT_FALSE(diagnostics_.ok()) << content;
  }
}

TEST_F(ImportTest, EveryMissionThatTheirVehiclesSwamBecomesOneOfOurs) {
  const fs::path data = fs::path(DIVE_SHARED_DATA) / "missions/acfr";
  if (!fs::exists(data)) GTEST_SKIP() << "the shared data is not here";
  int imported = 0;
  int timeouts = 0;
  int submerged = 0;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    if (entry.path().extension() != ".xml") continue;
    SCOPED_TRACE(entry.path().string());
    diagnostics_ = {};
    const auto mission = read_acfr(entry.path().string(), diagnostics_, source_);
    if (!mission) {
      ASSERT_FALSE(diagnostics_.ok());
      EXPECT_GT(diagnostics_.list().front().span.line, 0);
      continue;
    }
    ++imported;
    report_defects(*mission, source_, diagnostics_);
    for (const std::string& line : found()) {
      timeouts += line.starts_with("IMP-TIMEOUT") ? 1 : 0;
      submerged += line.starts_with("IMP-SUBMERGED") ? 1 : 0;
    }
    EXPECT_TRUE(ours(*mission, "theirs"));
  }
  EXPECT_GT(imported, 200);
  EXPECT_GT(timeouts, 0);
  EXPECT_GT(submerged, 0);
}

}  // namespace
}  // namespace dive::mission
