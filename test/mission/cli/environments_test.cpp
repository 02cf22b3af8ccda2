// The missions that come with dive: every leg is planned and certified, and those that dead
// reckoning is good enough for are ready to dive.

#include <filesystem>
#include <fstream>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/common/sanitizers.h"
#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

using testing::Ran;

struct Environment {
  std::string name;
  double clearance;
  std::size_t legs;
  bool dead_reckoning_will_do;
};

const std::vector<Environment>& environments() {
  // Cluttered is swum on the side, where the estimate does not see the vehicle slip; the transect
  // is long enough to drift by metres.
  static const std::vector<Environment> all{
      {"window", 1.0, 3, true},      {"cluttered", 0.3, 1, false}, {"pool1", 0.5, 1, true},
      {"pool2", 0.4, 1, true},       {"pool3", 0.5, 1, true},      {"pool4", 0.35, 1, true},
      {"maze", 0.4, 1, true},        {"transect", 0.6, 1, false},  {"wreck", 0.6, 3, true},
      {"penetration", 0.7, 4, true}, {"survey", 0.8, 13, true},    {"blocks", 0.8, 10, true}};
  return all;
}

std::string path_of(const std::string& name) {
  return std::string("'") + DIVE_SOURCE_DIR + "/missions/" + name + ".xml'";
}

class Environments : public ::testing::TestWithParam<Environment> {};

TEST_P(Environments, EveryLegIsPlannedAtItsClearance) {
  const auto& [name, clearance, legs, diveable] = GetParam();
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

TEST_P(Environments, SurviveEveryFaultInEveryStateOrSayWhyTheyAreNotReady) {
  const auto& [name, clearance, legs, diveable] = GetParam();
  const std::set<std::string> small = {"pool2", "pool3", "pool4", "transect", "cluttered"};
  if (!small.contains(name)) DIVE_SKIP_UNDER_SANITIZERS("the code is that of the small ones");
  const Ran ran = testing::run_dive("check --faults " + path_of(name), name);
  EXPECT_EQ(ran.status, diveable ? 0 : 1) << ran.err;
  EXPECT_EQ(ran.err.find("[CHK-DIVE]") == std::string::npos, diveable) << ran.err;
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
    const bool is_blind = !name.ends_with("_by_sight");  // a scenario dives those
    if (entry.path().extension() == ".xml" && is_known && is_blind) in_folder.insert(name + ".xml");
  }
  EXPECT_EQ(in_table, in_folder);
}

// The same water without a map: what the vehicle knows it has seen. The dive replays, and what it
// saw is a map for the next one.
TEST(UnknownWaters, AreDivedChartedAndPlannedInAgain) {
  DIVE_SKIP_UNDER_SANITIZERS("the scenarios dive in unknown water too");
  struct Water {
    std::string name, start, goal;
    double least;  ///< m, to anything; about half of what it is today.
  };
  std::string folder = (std::filesystem::temp_directory_path() / "dive-unknown-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  for (const Water& water : {
           Water{"wreck_unknown", "2,9,-12", "0,1,-13", 0.2},
           Water{"cluttered_unknown", "0,0.2,-3", "10,0.2,-3", 0.24},
           Water{"maze_unknown", "-2,1.6,-2.5", "14,14.5,-2.5", 0.2},
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

// A real hull, entered and left by a mission of our own: planned on its convex pieces, dived
// against its triangles.
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
  const Ran ran =
      testing::run_dive("check --json '" + (folder / "hull.xml").string() + "'", "hull");
  EXPECT_EQ(ran.status, 0) << ran.err << ran.out;
  fs::remove_all(folder);
}

}  // namespace
}  // namespace dive::mission
