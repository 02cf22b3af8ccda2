// The missions shipped with dive: every leg is planned and certified, and their dives survive every
// fault.

#include <filesystem>
#include <fstream>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/common/long_tests.h"
#include "test/common/sanitizers.h"
#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

using testing::Ran;

struct Environment {
  std::string name;
  double clearance;
  std::size_t legs;
};

const std::vector<Environment>& environments() {
  static const std::vector<Environment> all{
      {"window", 1.0, 3}, {"cluttered", 0.6, 1}, {"pool1", 0.6, 1},       {"pool2", 0.6, 1},
      {"pool3", 0.6, 1},  {"pool4", 0.6, 1},     {"maze", 0.4, 1},        {"transect", 0.6, 1},
      {"wreck", 0.6, 3},  {"survey", 0.8, 13},   {"penetration", 0.7, 4}, {"blocks", 0.8, 10},
      {"orbit", 0.6, 8}};
  return all;
}

std::string path_of(const std::string& name) {
  return std::string("'") + DIVE_SOURCE_DIR + "/missions/" + name + ".xml'";
}

class Environments : public ::testing::TestWithParam<Environment> {};

TEST_P(Environments, EveryLegIsPlannedAtItsClearance) {
  const auto& [name, clearance, legs] = GetParam();
  for (const char* seed : {"1", "2", "3"}) {
    const Ran ran = testing::run_dive("plan " + path_of(name) + " --json --seed " + seed, name);
    ASSERT_EQ(ran.status, 0) << ran.err;
    const auto plans = nlohmann::json::parse(ran.out).at("plans");
    EXPECT_EQ(plans.size(), legs);
    for (const auto& plan : plans) {
      EXPECT_EQ(plan.at("status"), "success");
      EXPECT_GE(plan.at("clearance_m").get<double>(), clearance);
    }
  }
}

TEST_P(Environments, SurviveEveryFaultInEveryState) {
  const std::string& name = GetParam().name;
  if (name != "pool3") DIVE_SKIP_UNDER_SANITIZERS("the code is that of the small one");
  if (name != "pool3" && name != "cluttered") DIVE_SKIP_LONG_TEST();
  const Ran ran = testing::run_dive("check --dives 1 --faults --instants 1 " + path_of(name), name);
  EXPECT_EQ(ran.status, 0) << ran.err;
}

INSTANTIATE_TEST_SUITE_P(Missions, Environments, ::testing::ValuesIn(environments()),
                         [](const auto& each) { return each.param.name; });

TEST(EnvironmentTable, HoldsEveryMission) {
  std::set<std::string> in_table;
  for (const Environment& each : environments()) in_table.insert(each.name + ".xml");
  std::set<std::string> in_folder;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(DIVE_SOURCE_DIR) + "/missions")) {
    const std::string name = entry.path().stem().string();
    const bool is_known = !name.ends_with("_unknown");
    const bool is_blind = !name.ends_with("_visual_inertial");  // a scenario covers those
    if (entry.path().extension() == ".xml" && is_known && is_blind) in_folder.insert(name + ".xml");
  }
  EXPECT_EQ(in_table, in_folder);
}

// The same missions in an unknown environment: the vehicle has only what it observed. The dive
// replays, and its observed map can be used for planning.
TEST(UnknownWaters, AreDivedChartedAndPlannedInAgain) {
  DIVE_SKIP_UNDER_SANITIZERS("the scenarios dive in unknown water too");
  DIVE_SKIP_LONG_TEST();
  struct Water {
    std::string name, start, goal;
    /// m, to any solid: at most half of the required clearance, as in CHK-DIVE-CLEARANCE.
    double least;
  };
  std::string folder = (std::filesystem::temp_directory_path() / "dive-unknown-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  for (const Water& water : {
           Water{"wreck_unknown", "2,9,-12", "0,1,-13", 0.2},
           Water{"cluttered_unknown", "0,0.2,-3", "12,0.2,-3", 0.225},
           Water{"maze_unknown", "-2,1.6,-2.5", "13,14.5,-2.5", 0.2},
       }) {
    const std::string log = folder + "/" + water.name + ".lcmlog";
    const Ran ran =
        testing::run_dive("run " + path_of(water.name) + " --json --log " + log, water.name);
    ASSERT_EQ(ran.status, 0) << ran.out << ran.err;
    const auto result = nlohmann::json::parse(ran.out);
    EXPECT_EQ(result.at("collisions"), 0);
    EXPECT_GT(result.at("min_clearance_m").get<double>(), water.least) << water.name;
    EXPECT_EQ(testing::run_dive("replay " + log, "replay").status, 0);
    const Ran plan =
        testing::run_dive("plan --map " + result.at("map").get<std::string>() + " --start " +
                              water.start + " --goal " + water.goal + " --clearance 0.2 --json",
                          "plan");
    EXPECT_EQ(plan.status, 0) << plan.out << plan.err;
  }
  std::filesystem::remove_all(folder);
}

// A real hull, entered and left by a test mission: planned on its convex pieces, dived against its
// triangles.
TEST(RealHull, IsEnteredAndLeft) {
  namespace fs = std::filesystem;
  const fs::path mesh =
      fs::path(DIVE_SHARED_DATA) / "meshes/wreck_sunkenship/sunkenship_distort.dae";
  if (!fs::exists(mesh)) GTEST_SKIP() << "the shared data is not here";
  std::string pattern = (fs::temp_directory_path() / "dive-hull-XXXXXX").string();
  const fs::path folder = mkdtemp(pattern.data());
  fs::copy_file(mesh, folder / "hull.dae");
  std::ofstream(folder / "hull.sdf")
      << "<sdf version='1.6'><model name='wreck'><static>true</static>"
         "<pose>0 0 -20 0 0 0</pose><link name='l'><collision name='steel'><geometry>"
         "<mesh><uri>hull.dae</uri></mesh></geometry></collision></link></model></sdf>";
  std::string mission = testing::content_of(std::string(DIVE_SOURCE_DIR) + "/missions/wreck.xml");
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(mission.find(from), std::string::npos) << from;
    mission.replace(mission.find(from), from.size(), to);
  };
  replace("maps/wreck.sdf", "hull.sdf");
  replace(R"(x="2" y="9" z="12")", R"(x="-14" y="6" z="14")");
  replace("max_depth=\"14.8\" min_altitude=\"0.2\"", "max_depth=\"25\" min_altitude=\"0\"");
  replace(R"(x="0" y="0" z="13.2")", R"(x="0.8" y="-0.1" z="19.9")");
  replace(R"(x="-8.5" y="1.2" z="12.8")", R"(x="2.8" y="-0.1" z="17.9")");
  replace(R"(x="2" y="9" z="12")", R"(x="-14" y="6" z="14")");
  std::ofstream(folder / "hull.xml") << mission;
  const std::string path = "'" + (folder / "hull.xml").string() + "'";
  // Ten metres of open water before the hull make the position uncertain, and the check says so.
  const Ran check = testing::run_dive("check --json --static " + path, "hull");
  EXPECT_EQ(check.status, 2) << check.err;
  const auto report = nlohmann::json::parse(check.out);
  for (const auto& diagnostic : report.at("diagnostics")) {
    EXPECT_EQ(diagnostic.at("code"), "CHK-MARGIN");
  }
  for (const auto& leg : report.at("plans")) EXPECT_EQ(leg.at("status"), "success");
  const Ran ran = testing::run_dive("run --json " + path, "hull");
  EXPECT_EQ(ran.status, 0) << ran.err << ran.out;
  EXPECT_EQ(nlohmann::json::parse(ran.out).at("collisions"), 0);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace dive::mission
