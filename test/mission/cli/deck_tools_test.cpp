// The commands beside check and run: explain, graph, import, findings as SARIF, pairs of faults.

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/common/long_tests.h"
#include "test/common/sanitizers.h"
#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

using testing::Ran;
using testing::run_here;
using testing::shipped;

TEST(Explain, NamesTheLeakTheRungAndWhatTheVehicleDidNext) {
  ASSERT_EQ(run_here("run --leak-at 12 --log leak.lcmlog " + shipped("pool3")).status, 1);
  const Ran text = run_here("explain leak.lcmlog");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("the mission starts"));
  EXPECT_THAT(text.out, HasSubstr("swim asks for plan 1"));
  EXPECT_THAT(text.out, HasSubstr("water in the hull"));
  const Ran ran = run_here("explain --json leak.lcmlog");
  ASSERT_EQ(ran.status, 0) << ran.err;
  const std::string all = nlohmann::json::parse(ran.out).dump();
  EXPECT_THAT(all, HasSubstr("abort_and_surface"));
  EXPECT_THAT(all, HasSubstr("dive.abort_retrace"));
}

TEST(Explain, RefusesWhatIsNoLog) {
  const Ran ran = run_here("explain " + shipped("pool3"));
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("pool3.xml"));
  EXPECT_EQ(ran.out, "");
}

TEST(Graph, DrawsTheMissionAndWhatTheExecutiveAdds) {
  for (const std::string format : {"dot", "scxml"}) {
    const Ran ran = run_here("graph --format " + format + " " + shipped("window"));
    ASSERT_EQ(ran.status, 0) << ran.err;
    for (const char* state : {"rooms", "dive.abort_retrace", "dive.emergency", "surfaced"}) {
      EXPECT_THAT(ran.out, HasSubstr(state)) << format;
    }
  }
  EXPECT_EQ(run_here("graph --format png " + shipped("window")).status, 2);
}

TEST(Import, WritesAMissionThatCheckReads) {
  const std::string plan = R"({"fileType":"Plan","mission":{"items":[
      {"type":"SimpleItem","command":16,"frame":3,"params":[0,0,0,null,-33.8700,151.2100,0]},
      {"type":"SimpleItem","command":16,"frame":3,"params":[0,0,0,null,-33.8701,151.2100,0]}],
      "plannedHomePosition":[-33.87,151.21,0]},"version":1})";
  const Ran ran =
      run_here("import qgc harbour.plan --depth 3", "printf '%s' '" + plan + "' > harbour.plan;");
  ASSERT_EQ(ran.status, 0) << ran.err;
  const Ran checked = run_here("check --static harbour.xml");
  EXPECT_EQ(checked.status, 0) << checked.err;
  EXPECT_EQ(run_here("import qgc nowhere.plan").status, 2);
  EXPECT_EQ(run_here("import lawnmower harbour.plan").status, 2);
}

TEST(Sarif, PointsAtTheLineOfEveryFinding) {
  const std::string bad =
      std::string(DIVE_SOURCE_DIR) + "/test/mission/malformed/target_unknown.xml";
  const Ran ran = run_here("check --sarif '" + bad + "'");
  EXPECT_EQ(ran.status, 2);
  const auto run = nlohmann::json::parse(ran.out).at("runs").at(0);
  const auto& results = run.at("results");
  ASSERT_FALSE(results.empty());
  for (const auto& result : results) {
    const auto& place = result.at("locations").at(0).at("physicalLocation");
    EXPECT_THAT(place.at("artifactLocation").at("uri").get<std::string>(),
                HasSubstr("target_unknown.xml"));
    EXPECT_GT(place.at("region").at("startLine").get<int>(), 1);
    EXPECT_THAT(run.at("tool").at("driver").at("rules").dump(),
                HasSubstr("\"id\":" + result.at("ruleId").dump()));
  }
}

TEST(Replay, TellsWhatAChangedMissionWouldHaveDone) {
  ASSERT_EQ(run_here("run --log dive.lcmlog " + shipped("pool3")).status, 0);
  EXPECT_EQ(run_here("replay --mission " + shipped("pool3") + " dive.lcmlog").status, 0);
  // The same mission with a leg whose timeout is shorter than the leg took.
  const std::string change = "mkdir -p maps; cp '" DIVE_SOURCE_DIR
                             "/missions/maps/pool3.sdf' maps; sed 's/timeout=\"200\"/"
                             "timeout=\"12\"/' " +
                             shipped("pool3") + " > changed.xml;";
  const Ran ran = run_here("replay --mission changed.xml dive.lcmlog", change);
  EXPECT_EQ(ran.status, 1) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("DIVERGES"));
  EXPECT_THAT(ran.out, HasSubstr("  - "));
  EXPECT_THAT(ran.out, HasSubstr("  +    12.06 s  swim -> ascend (swim took longer than 12 s)"));
  const Ran json = run_here("replay --json --mission changed.xml dive.lcmlog");
  EXPECT_EQ(nlohmann::json::parse(json.out).at("replayed").at(1).at("event"), "timeout.swim");
  EXPECT_EQ(run_here("replay --mission nowhere.xml dive.lcmlog").status, 2);
}

bool has_fault_of(const nlohmann::json& dive, const std::string& sensor) {
  return std::ranges::any_of(dive.at("injected"), [&](const nlohmann::json& fault) {
    return fault.at("fault").get<std::string>().starts_with(sensor);
  });
}

// Without attitude and depth the flippers rest, and a vehicle below a pipe rises against it
// (doc/decisions/blind-and-safely-held.md). Every other pair is survived.
TEST(PairsOfFaults, AreAllDivedUnderThreePipesAndDecideTheExitStatus) {
  DIVE_SKIP_UNDER_SANITIZERS("many dives, and single faults take the same steps");
  DIVE_SKIP_LONG_TEST();
  const Ran ran = run_here("check --dives 1 --pairs --instants 1 --json '" DIVE_SOURCE_DIR
                           "/test/mission/simulation/three_pipes.xml'");
  EXPECT_EQ(ran.err, "") << "no progress beside JSON";
  const auto faults = nlohmann::json::parse(ran.out).at("faults");
  EXPECT_GT(faults.size(), 150U);
  bool all_safe = true;
  for (const auto& each : faults) {
    const bool is_safe = each.at("safe").get<bool>();
    all_safe = all_safe && is_safe;
    const bool can_control_nothing = has_fault_of(each, "imu_") && has_fault_of(each, "depth_");
    EXPECT_TRUE(is_safe || can_control_nothing) << each.dump();
  }
  EXPECT_EQ(ran.status, all_safe ? 0 : 1);
}

}  // namespace
}  // namespace dive::mission
