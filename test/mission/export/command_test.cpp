// `dive export`, as it is typed.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::Ran;

constexpr const char* kWindow = DIVE_SOURCE_DIR "/missions/window.xml";

Ran run(const std::string& arguments) {
  return testing::run_dive(arguments,
                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
}

fs::path folder() {
  return fs::path(::testing::TempDir()) / "dive-command" /
         ::testing::UnitTest::GetInstance()->current_test_info()->name();
}

std::size_t lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST(ExportCommand, NamesTheFormatsThatAKindOfFileHas) {
  const Ran mission = run(fmt::format("export {} --format mcap", kWindow));
  EXPECT_EQ(mission.status, 2);
  EXPECT_THAT(mission.err, HasSubstr("write --format geojson, kml, csv, ply, gltf\n"));
  const Ran map = run("export " DIVE_SOURCE_DIR "/missions/maps/window.sdf --format csv");
  EXPECT_EQ(map.status, 2);
  EXPECT_THAT(map.err, HasSubstr("a map cannot become csv: write --format ply, gltf\n"));
  const Ran scenario =
      run("export " DIVE_SOURCE_DIR "/missions/scenarios/leak_in_the_window.xml --format csv");
  EXPECT_EQ(scenario.status, 2);
  EXPECT_THAT(scenario.err, HasSubstr("this is a scenario"));
  const Ran none = run("export none.xml --format csv");
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.err, HasSubstr("none.xml: the file cannot be read"));
}

TEST(ExportCommand, GeographicFormatsNeedAnOrigin) {
  const Ran ran = run(fmt::format("export {} --format kml --force", kWindow));
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("add <origin latitude=\"...\" longitude=\"...\"/>"));
  EXPECT_FALSE(fs::exists(folder() / "window.kml")) << "nothing is left of it";
}

TEST(ExportCommand, ADiveBecomesATableARecordingAndShapes) {
  ASSERT_EQ(run(fmt::format("run {} --log dive.lcmlog --force --json", kWindow)).status, 0);
  const Ran csv = run("export dive.lcmlog --format csv --output track.csv --force --json");
  ASSERT_EQ(csv.status, 0) << csv.err;
  const std::string table = testing::content_of((folder() / "track.csv").string());
  const std::string header = table.substr(0, table.find("\r\n"));
  EXPECT_EQ(header,
            "time_s,true_x_m,true_y_m,true_z_m,true_heading_deg,estimated_x_m,estimated_y_m,"
            "estimated_z_m,estimated_heading_deg,sigma_m,depth_m,speed_mps,battery_fraction,state,"
            "goal,rung");
  EXPECT_GT(lines(table), 500U);
  for (const char* format : {"mcap", "ply", "gltf"}) {
    const Ran ran = run(fmt::format("export dive.lcmlog --format {} --force --json", format));
    ASSERT_EQ(ran.status, 0) << ran.err;
    const auto json = nlohmann::json::parse(ran.out);
    EXPECT_EQ(json.at("output"), fmt::format("dive.{}", format));
    EXPECT_EQ(fs::file_size(folder() / fmt::format("dive.{}", format)), json.at("bytes"));
  }
  const Ran again = run("export dive.lcmlog --format mcap");
  EXPECT_EQ(again.status, 2) << "no file is replaced without --force";
}

TEST(ExportCommand, APlanBecomesATableOfItsWaypoints) {
  fs::create_directories(folder());
  const Ran planned = run(fmt::format("plan {} --json", kWindow));
  ASSERT_EQ(planned.status, 0);
  std::ofstream(folder() / "plan.json") << planned.out;
  const auto json = nlohmann::json::parse(planned.out);
  std::size_t waypoints = 0;
  for (const auto& leg : json.at("plans")) waypoints += leg.at("waypoints").size();
  const Ran csv = run("export plan.json --format csv --force");
  ASSERT_EQ(csv.status, 0) << csv.err;
  const std::string table = testing::content_of((folder() / "plan.csv").string());
  EXPECT_EQ(lines(table), waypoints + 1);
  const auto& first = json.at("plans")[0];
  EXPECT_THAT(
      table,
      HasSubstr(fmt::format(
          "\r\n\"{}\",\"{}\",0,{:.3f},{:.3f},{:.3f},", first.at("state").get<std::string>(),
          first.at("goal").get<std::string>(), first.at("waypoints")[0][0].get<double>(),
          first.at("waypoints")[0][1].get<double>(), first.at("waypoints")[0][2].get<double>())));
  EXPECT_EQ(run("export plan.json --format gltf --force").status, 0);
  const Ran kml = run("export plan.json --format kml");
  EXPECT_EQ(kml.status, 2);
  EXPECT_THAT(kml.err, HasSubstr("write --format csv, ply, gltf"));
}

TEST(ExportCommand, SaysWhatIsWrongWithAPlan) {
  fs::create_directories(folder());
  const auto error_of = [](const std::string& text) {
    std::ofstream(folder() / "bad.json") << text;
    const Ran ran = run("export bad.json --format ply --force");
    EXPECT_EQ(ran.status, 2);
    return ran.err;
  };
  EXPECT_THAT(error_of("{\"plans\": 3}"), HasSubstr("it is not the JSON of a plan"));
  EXPECT_THAT(error_of(R"({"plans": [{"status": "success"}]})"),
              HasSubstr("path 1 has no list of waypoints"));
  EXPECT_THAT(
      error_of(
          R"({"plans": [{"status": "success", "waypoints": [[0, 0, -1, 0, 0, 0, 1], [1, 2]]}]})"),
      HasSubstr("path 1: waypoint 2 is not x, y, z and a unit quaternion x, y, z, w"));
  EXPECT_THAT(
      error_of(R"({"plans": [{"status": "success", "waypoints": [[0, 0, -1, 0, 0, 0, 2]]}]})"),
      HasSubstr("waypoint 1 is not"));
  EXPECT_THAT(error_of(R"({"plans": [{"status": "no path", "waypoints": []}]})"),
              HasSubstr("no path was found in this plan"));
}

TEST(ExportCommand, AMissionWithAnOriginBecomesGeoJson) {
  std::string text = testing::content_of(kWindow);
  const std::size_t at = text.find("<vehicle");
  text.insert(at, "<origin latitude=\"44.65\" longitude=\"-63.57\"/>\n  ");
  fs::create_directories(folder() / "maps");
  fs::copy_file(DIVE_SOURCE_DIR "/missions/maps/window.sdf", folder() / "maps/window.sdf",
                fs::copy_options::overwrite_existing);
  std::ofstream(folder() / "here.xml") << text;
  const Ran ran = run("export here.xml --format geojson --force");
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto json =
      nlohmann::json::parse(testing::content_of((folder() / "here.geojson").string()));
  std::size_t paths = 0;
  for (const auto& feature : json.at("features")) {
    const auto& geometry = feature.at("geometry");
    if (geometry.at("type") == "LineString") ++paths;
    const auto& first = geometry.at("type") == "Point" ? geometry.at("coordinates")
                                                       : geometry.at("coordinates").at(0);
    EXPECT_NEAR(first.at(0).get<double>(), -63.57, 0.01);
    EXPECT_NEAR(first.at(1).get<double>(), 44.65, 0.01);
  }
  EXPECT_GT(paths, 1U);
}

TEST(ExportCommand, AGridIsAMapOfAMissionItsLogAndItsShape) {
  fs::create_directories(folder());
  std::string grid = "ncols 15\nnrows 15\nxllcenter -14\nyllcenter -14\ncellsize 2\n";
  for (int row = 0; row < 15; ++row) {
    for (int column = 0; column < 15; ++column) grid += fmt::format("{} ", -8.0 - 0.1 * column);
    grid += "\n";
  }
  std::ofstream(folder() / "bottom.asc") << grid;
  std::ofstream(folder() / "over.xml")
      << "<mission xmlns=\"urn:dive:mission:1\" id=\"over\"><vehicle model=\"aqua2\" "
         "speed=\"0.4\"/>"
         "<map file=\"bottom.asc\"/><start x=\"-6\" y=\"0\" z=\"1\" z_units=\"DEPTH\" "
         "heading_deg=\"90\"/><limits max_depth=\"9\" min_altitude=\"0.5\" clearance=\"0.6\" "
         "mission_timeout=\"300\" battery_reserve=\"0.3\"/><states initial=\"there\"><goto "
         "id=\"there\" x=\"0\" y=\"0\" z=\"3\" z_units=\"ALTITUDE\" timeout=\"90\" "
         "on_timeout=\"up\"><transition event=\"done.state.there\" target=\"up\"/></goto><surface "
         "id=\"up\"><transition event=\"done.state.up\" target=\"end\"/></surface><final "
         "id=\"end\"/></states></mission>";
  const Ran dived = run("run over.xml --log over.lcmlog --force --json");
  ASSERT_EQ(dived.status, 0) << dived.err << dived.out;
  fs::rename(folder() / "bottom.asc", folder() / "elsewhere.asc");
  EXPECT_EQ(run("replay over.lcmlog").status, 0) << "a log needs no other file";
  const Ran shape = run("export elsewhere.asc --format ply --force");
  EXPECT_EQ(shape.status, 0) << shape.err;
  EXPECT_THAT(testing::content_of((folder() / "elsewhere.ply").string()),
              HasSubstr("element face 392\n"));
  const Ran plan = run("plan --map elsewhere.asc --start -6,0,-3 --goal 6,0,-3 --json");
  EXPECT_EQ(plan.status, 0) << plan.err;
}

}  // namespace
}  // namespace dive::mission
