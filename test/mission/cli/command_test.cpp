// The command as a user or a script meets it: exit status, stdout, stderr.

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

using testing::Ran;

// Runs `dive ARGUMENTS` in a folder of the test's own.
Ran dive(const std::string& arguments, const std::string& setup = {}) {
  const auto& test = *::testing::UnitTest::GetInstance()->current_test_info();
  return testing::run_dive(arguments, test.name(), setup);
}

const std::string kWindow = std::string("'") + DIVE_SOURCE_DIR + "/missions/window.xml'";
const std::string kMap = std::string("'") + DIVE_SOURCE_DIR + "/missions/maps/window.sdf'";

TEST(Command, HelpShowsExamplesFirst) {
  EXPECT_THAT(dive("--help").out, StartsWith("Examples:"));
  for (const char* command : {"check", "plan", "run", "replay"}) {
    const Ran ran = dive(std::string(command) + " --help");
    EXPECT_EQ(ran.status, 0);
    EXPECT_THAT(ran.out, StartsWith(std::string("Examples:\n  dive ") + command));
  }
  EXPECT_THAT(dive("--version").out, StartsWith("dive 0."));
}

TEST(Command, WrongUsageIsTwoWithAHint) {
  EXPECT_EQ(dive("").status, 2);
  const Ran misspelt = dive("chekc missions/window.xml");
  EXPECT_EQ(misspelt.status, 2);
  EXPECT_THAT(misspelt.err, HasSubstr("did you mean 'check'?"));
  EXPECT_EQ(misspelt.out, "");
  EXPECT_THAT(dive("run --sede 4 " + kWindow).err, HasSubstr("did you mean '--seed'?"));
  EXPECT_EQ(dive("run").status, 2);
  EXPECT_EQ(dive("check").status, 2);
  EXPECT_EQ(dive("run --seed minus " + kWindow).status, 2);
  EXPECT_THAT(dive("run --set curent_x=1 " + kWindow).err, HasSubstr("did you mean 'current_x'?"));
  EXPECT_EQ(dive("run --set current_x=fast " + kWindow).status, 2);
  EXPECT_EQ(dive("plan --map " + kMap).status, 2);
  EXPECT_THAT(dive("plan --map " + kMap + " --start 1,2 --goal 1,2,3").err,
              HasSubstr("expected x,y,z"));
}

TEST(Command, WaterIsOneThatThereIsAndOfTheSimulator) {
  const std::string by_sight = std::string(" '") + DIVE_SOURCE_DIR + "/missions/pool_by_sight.xml'";
  const Ran linked = dive("run --lcm memq:// --water green_lake" + by_sight);
  EXPECT_EQ(linked.status, 2);
  EXPECT_THAT(linked.err, HasSubstr("with --lcm give those to dive sim"));
  const Ran muddy = dive("run --water green_lakes" + by_sight);
  EXPECT_EQ(muddy.status, 2);
  EXPECT_THAT(muddy.err, HasSubstr("did you mean 'green_lake'?"));
}

TEST(Command, CamerasAreThoseOfAVehicleThatGoesBySight) {
  const std::string by_sight = std::string(" '") + DIVE_SOURCE_DIR + "/missions/pool_by_sight.xml'";
  const std::string linked = "run --lcm memq:// --cameras nowhere ";
  for (const auto& [line, words] :
       {std::pair("run --cameras nowhere" + by_sight, "give its --lcm URL"),
        {linked + kWindow, "its estimator is primitive"},
        {linked + by_sight, "nowhere: no dataset in the ASL format"}}) {
    const Ran ran = dive(line);
    EXPECT_EQ(ran.status, 2) << line;
    EXPECT_THAT(ran.err, HasSubstr(words)) << line;
  }
}

TEST(Command, UnreadableFilesAreTwo) {
  for (const char* command : {"check", "run", "plan", "replay"}) {
    const Ran ran = dive(std::string(command) + " nowhere.xml");
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_THAT(ran.err, HasSubstr("nowhere.xml")) << command;
    EXPECT_THAT(ran.err, HasSubstr("no such file")) << command;
  }
  EXPECT_EQ(dive("replay " + kWindow).status, 2) << "not a log";
  EXPECT_EQ(dive("run --log out.txt/a.lcmlog " + kWindow).status, 2);
}

TEST(Command, CheckSaysOkWithTheKeysScriptsRelyOn) {
  const Ran ran = dive("check --static --json " + kWindow);
  EXPECT_EQ(ran.status, 0) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_TRUE(json.at("ok").get<bool>());
  EXPECT_TRUE(json.at("diagnostics").is_array());
  for (const char* key : {"distance_m", "duration_s", "energy_wh"}) {
    EXPECT_GT(json.at("budget").at(key).get<double>(), 0.0);
  }
  ASSERT_EQ(json.at("plans").size(), 3U);
  for (const char* key : {"state", "clearance_m", "length_m", "time_ms", "warm_starts"}) {
    EXPECT_TRUE(json.at("plans").at(0).contains(key)) << key;
  }
}

TEST(Command, PlanIsTheSameForTheSameSeed) {
  const std::string arguments =
      "plan --json --attitude horizontal --clearance 1 --start -1,-2,-4 "
      "--goal 9.8,-2,-4.6 --svg plan.svg --map " +
      kMap;
  const Ran ran = dive(arguments);
  EXPECT_EQ(ran.status, 0) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json.at("status"), "success");
  EXPECT_GE(json.at("clearance_m").get<double>(), 1.0);
  EXPECT_GE(json.at("warm_starts").get<int>(), 1);
  for (const char* stage : {"optimise", "warm_start", "certify"}) {
    EXPECT_GT(json.at("stages_ms").at(stage).get<double>(), 0.0);
  }
  EXPECT_EQ(nlohmann::json::parse(dive(arguments).out).at("waypoints"), json.at("waypoints"));
}

TEST(Command, PlanRefusesAGoalInsideTheWall) {
  const Ran ran =
      dive("plan --json --start -1,-2,-4 --goal 6.1,-2,-4.6 --clearance 1 --map " + kMap);
  EXPECT_EQ(ran.status, 2);
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json.at("status"), "invalid");
  EXPECT_FALSE(json.at("reason").get<std::string>().empty());
}

TEST(Command, RunThenReplay) {
  const Ran ran = dive("run --json --seed 3 --log a.lcmlog --svg a.svg " + kWindow);
  EXPECT_EQ(ran.status, 0) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json.at("outcome"), "success");
  EXPECT_EQ(json.at("final_state"), "surfaced");
  for (const char* key : {"cause", "duration_s", "distance_m", "min_clearance_m", "collisions",
                          "replans", "estimate_error_m"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  for (const char* key : {"t", "from", "to", "event", "cause"}) {
    EXPECT_TRUE(json.at("transitions").at(0).contains(key)) << key;
  }
  const Ran replayed = dive("replay --json a.lcmlog");
  EXPECT_EQ(replayed.status, 0) << replayed.err;
  const auto report = nlohmann::json::parse(replayed.out);
  EXPECT_TRUE(report.at("identical").get<bool>());
  EXPECT_TRUE(report.at("first_divergence").is_null());
  EXPECT_GT(report.at("events").get<int>(), 10'000);
}

TEST(Command, RunShowsWhereItIsAndEndsWithAVerdict) {
  const Ran ran = dive("run --log a.lcmlog " + kWindow);
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("in -> room_b"));
  EXPECT_THAT(ran.err, HasSubstr("depth"));
  EXPECT_THAT(ran.err, HasSubstr("clearance"));
  EXPECT_THAT(ran.out, StartsWith("SUCCESS"));
  EXPECT_THAT(ran.out, HasSubstr("log a.lcmlog"));
  EXPECT_EQ(ran.err.find('\033'), std::string::npos) << "no escape codes into a file";
}

TEST(Command, AnAbortedDiveIsOne) {
  const Ran ran = dive("run --json --leak-at 20 --log a.lcmlog " + kWindow);
  EXPECT_EQ(ran.status, 1);
  EXPECT_EQ(nlohmann::json::parse(ran.out).at("outcome"), "aborted");
  EXPECT_EQ(dive("replay a.lcmlog").status, 0) << "an aborted dive replays as well";
}

TEST(Command, AFullDiskLosesTheLogNotTheDive) {
  // A limit on the size of files stands in for a full disk; the signal that goes with it is
  // ignored.
  const Ran ran = dive("run --json --log a.lcmlog " + kWindow, "trap '' XFSZ; ulimit -f 500; ");
  EXPECT_EQ(ran.status, 1);
  EXPECT_EQ(nlohmann::json::parse(ran.out).at("final_state"), "surfaced");
  EXPECT_THAT(ran.err, HasSubstr("not complete"));
  const Ran replayed = dive("replay --json a.lcmlog");
  const auto report = nlohmann::json::parse(replayed.out);
  EXPECT_TRUE(report.at("identical").get<bool>()) << "what is there is whole";
}

}  // namespace
}  // namespace dive::mission
