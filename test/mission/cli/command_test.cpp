// The command line interface: exit status, stdout, stderr.

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

using testing::own_folder;
using testing::Ran;
using testing::run_here;

const std::string kWindow = std::string("'") + DIVE_SOURCE_DIR + "/missions/window.xml'";
const std::string kMap = std::string("'") + DIVE_SOURCE_DIR + "/missions/maps/window.sdf'";

TEST(Command, HelpShowsExamplesFirst) {
  EXPECT_THAT(run_here("--help").out, StartsWith("Examples:"));
  for (const char* command : {"check", "plan", "run", "replay"}) {
    const Ran ran = run_here(std::string(command) + " --help");
    EXPECT_EQ(ran.status, 0);
    EXPECT_THAT(ran.out, StartsWith(std::string("Examples:\n  dive ") + command));
  }
  EXPECT_THAT(run_here("--version").out, StartsWith("dive 0."));
}

TEST(Command, WrongUsageIsTwoWithAHint) {
  EXPECT_EQ(run_here("").status, 2);
  const Ran misspelt = run_here("chekc missions/window.xml");
  EXPECT_EQ(misspelt.status, 2);
  EXPECT_THAT(misspelt.err, HasSubstr("did you mean 'check'?"));
  EXPECT_EQ(misspelt.out, "");
  EXPECT_THAT(run_here("run --sede 4 " + kWindow).err, HasSubstr("did you mean '--seed'?"));
  EXPECT_EQ(run_here("run").status, 2);
  EXPECT_EQ(run_here("check").status, 2);
  EXPECT_EQ(run_here("run --seed minus " + kWindow).status, 2);
  EXPECT_THAT(run_here("run --set curent_x=1 " + kWindow).err,
              HasSubstr("did you mean 'current_x'?"));
  EXPECT_EQ(run_here("run --set current_x=fast " + kWindow).status, 2);
  EXPECT_EQ(run_here("plan --map " + kMap).status, 2);
  EXPECT_THAT(run_here("plan --map " + kMap + " --start 1,2 --goal 1,2,3").err,
              HasSubstr("expected x,y,z"));
}

TEST(Command, WaterIsOneThatThereIsAndOfTheSimulator) {
  const std::string by_sight =
      std::string(" '") + DIVE_SOURCE_DIR + "/missions/pool_visual_inertial.xml'";
  const Ran linked = run_here("run --lcm memq:// --simulated-water green_lake" + by_sight);
  EXPECT_EQ(linked.status, 2);
  EXPECT_THAT(linked.err, HasSubstr("with --lcm give those to dive sim"));
  const Ran muddy = run_here("run --simulated-water green_lakes" + by_sight);
  EXPECT_EQ(muddy.status, 2);
  EXPECT_THAT(muddy.err, HasSubstr("did you mean 'green_lake'?"));
}

TEST(Command, CamerasAreForMissionsWithVision) {
  const std::string by_sight =
      std::string(" '") + DIVE_SOURCE_DIR + "/missions/pool_visual_inertial.xml'";
  const std::string linked = "run --lcm memq:// --cameras nowhere ";
  for (const auto& [line, words] : {std::pair("run --cameras nowhere" + by_sight, "give --lcm URL"),
                                    {"run --lcm memq://" + by_sight, "give --cameras DIR"},
                                    {linked + kWindow, "its estimator is primitive"},
                                    {linked + by_sight, "nowhere: no dataset in the ASL format"}}) {
    const Ran ran = run_here(line);
    EXPECT_EQ(ran.status, 2) << line;
    EXPECT_THAT(ran.err, HasSubstr(words)) << line;
  }
}

TEST(Command, TheCalibrationOfSimulatedCamerasIsWrittenOnceThereAreCameras) {
  const Ran blind = run_here("sim --write-calibration cameras " + kWindow);
  EXPECT_EQ(blind.status, 2);
  EXPECT_THAT(blind.err, HasSubstr("no cameras to calibrate"));
  const Ran written =
      run_here("sim --write-calibration cameras --simulated-water green_lake " + kWindow);
  EXPECT_EQ(written.status, 0) << written.err;
  const Ran unwritable = run_here(
      "sim --write-calibration cameras/imu0/sensor.yaml --simulated-water green_lake " + kWindow);
  EXPECT_EQ(unwritable.status, 2);
  EXPECT_THAT(unwritable.err, HasSubstr("sensor.yaml"));
}

TEST(Command, UnreadableFilesAreTwo) {
  for (const char* command : {"check", "run", "plan", "replay"}) {
    const Ran ran = run_here(std::string(command) + " nowhere.xml");
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_THAT(ran.err, HasSubstr("nowhere.xml")) << command;
    EXPECT_THAT(ran.err, HasSubstr("no such file")) << command;
  }
  EXPECT_EQ(run_here("replay " + kWindow).status, 2) << "not a log";
  EXPECT_EQ(run_here("run --log out.txt/a.lcmlog " + kWindow).status, 2);
}

TEST(Command, ErrorsAreOfTheKindThatTheFileIs) {
  const std::string poses = " --start -1,-2,-4 --goal 9.8,-2,-4.6";
  const std::string broken_map =
      "printf '<?xml version=\"1.0\"?>\\n<!-- <mission> -->\\n<sdf version=\"9.9\"/>' > m.sdf;";
  const std::string cloud = "printf 'ply\\nformat ascii 1.0\\n' > c;";
  struct Wrong {
    std::string setup;
    std::string arguments;
    std::string says;
  };
  for (const Wrong& wrong : std::vector<Wrong>{
           {"", "sim " + kMap, "this is a map: give the start pose with --start"},
           {"", "sim --start 0,0,-3 " + kWindow, "this is a mission"},
           {broken_map, "sim --start 0,0,-3 m.sdf", "MAP-VERSION"},
           {"", "sim --start 0,0,-3 nowhere.sdf", "no such file"},
           {"", "plan " + kMap, "this is a map, not a mission: give it with --map"},
           {cloud, "plan c", "this is a point cloud, not a mission: give it with --cloud"},
           {"", "plan --map " + kWindow, "this is a mission, not a map"},
           {cloud, "plan --map c" + poses, "this is a point cloud, not a map"},
           {broken_map, "plan --map m.sdf" + poses, "MAP-VERSION"},
           {"", "check " + kMap, "this is a map: a mission names it"},
           {"", "test " + kWindow, "this is a mission: dive check, plan and run read it"}}) {
    const Ran ran = run_here(wrong.arguments, wrong.setup);
    EXPECT_EQ(ran.status, 2) << wrong.arguments;
    EXPECT_THAT(ran.err, HasSubstr(wrong.says)) << wrong.arguments;
  }
}

TEST(Command, CheckPrintsOkWithTheKeysScriptsRelyOn) {
  const Ran ran = run_here("check --static --json " + kWindow);
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

TEST(Command, WithoutASimulatedWorldNoPathIsCertified) {
  const std::string source = DIVE_SOURCE_DIR "/test/mission/accepted/unknown_environment.xml";
  const std::string alone = "sed 's# simulation_map=\"[^\"]*\"##' '" + source + "' > alone.xml;";
  const std::string words = "straight line, not certified (no simulated world)";
  for (const char* line : {"check --static alone.xml", "plan alone.xml"}) {
    const Ran ran = run_here(line, alone);
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr(words)) << line;
  }
  const Ran ran = run_here("run alone.xml", alone);
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("no simulated world is given"));
}

TEST(Command, PlanIsTheSameForTheSameSeed) {
  const std::string arguments =
      "plan --json --attitude horizontal --clearance 1 --start -1,-2,-4 "
      "--goal 9.8,-2,-4.6 --svg plan.svg --force --map " +
      kMap;
  const Ran ran = run_here(arguments);
  EXPECT_EQ(ran.status, 0) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json.at("status"), "success");
  EXPECT_GE(json.at("clearance_m").get<double>(), 1.0);
  EXPECT_GE(json.at("warm_starts").get<int>(), 1);
  for (const char* stage : {"optimise", "warm_start", "certify"}) {
    EXPECT_GT(json.at("stages_ms").at(stage).get<double>(), 0.0);
  }
  EXPECT_EQ(nlohmann::json::parse(run_here(arguments).out).at("waypoints"), json.at("waypoints"));
}

// A start beside the wreck: the plan is not a success, reports the position, and is used only if
// allowed.
TEST(Command, PlanOutOfANarrowStartIsReduced) {
  const std::string arguments =
      "plan --start 5.8,0.3,-5.8,0,0,90 --goal 9,-3,-3 --clearance 0.6 --map '" +
      std::string(DIVE_SOURCE_DIR) + "/missions/maps/wreck.sdf'";
  const Ran refused = run_here(arguments + " --json");
  EXPECT_EQ(refused.status, 1) << refused.err;
  const auto json = nlohmann::json::parse(refused.out);
  EXPECT_EQ(json.at("status"), "reduced");
  const double clearance = json.at("clearance_m").get<double>();
  EXPECT_GT(clearance, 0.0);
  EXPECT_LT(clearance, 0.6);
  EXPECT_THAT(json.at("reason").get<std::string>(), HasSubstr("less than 0.6 m"));
  const auto& reduced = json.at("reduced");
  EXPECT_GT(reduced.at("length_m").get<double>(), 0.0);
  EXPECT_LT(reduced.at("length_m").get<double>(), json.at("length_m").get<double>());
  EXPECT_EQ(reduced.at("clearance_m"), json.at("clearance_m"));
  EXPECT_LT(std::hypot(reduced.at("x").get<double>() - 5.8, reduced.at("y").get<double>() - 0.3,
                       reduced.at("z").get<double>() + 5.8),
            reduced.at("length_m").get<double>() + 0.01);
  EXPECT_FALSE(reduced.at("obstacle").get<std::string>().empty());
  EXPECT_FALSE(reduced.at("accepted").get<bool>());

  const Ran allowed = run_here(arguments + " --allow-reduced --json");
  EXPECT_EQ(allowed.status, 0);
  const auto used = nlohmann::json::parse(allowed.out);
  EXPECT_EQ(used.at("status"), "reduced");
  EXPECT_TRUE(used.at("reduced").at("accepted").get<bool>());
  EXPECT_EQ(used.at("waypoints"), json.at("waypoints"));

  const Ran text = run_here(arguments + " --svg reduced.svg");
  EXPECT_EQ(text.status, 1);
  EXPECT_THAT(text.out, HasSubstr("goal: reduced: "));
  EXPECT_THAT(text.out, HasSubstr("narrowest at "));
  EXPECT_THAT(text.out, HasSubstr("--allow-reduced"));
}

TEST(Command, PlanRefusesAGoalInsideTheWall) {
  const Ran ran =
      run_here("plan --json --start -1,-2,-4 --goal 6.1,-2,-4.6 --clearance 1 --map " + kMap);
  EXPECT_EQ(ran.status, 2);
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json.at("status"), "invalid");
  EXPECT_FALSE(json.at("reason").get<std::string>().empty());
}

TEST(Command, RunThenReplay) {
  const Ran ran = run_here("run --json --seed 3 --log a.lcmlog --svg a.svg " + kWindow);
  EXPECT_EQ(ran.status, 0) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json.at("outcome"), "success");
  EXPECT_EQ(json.at("final_state"), "surfaced");
  for (const char* key :
       {"cause", "duration_s", "distance_m", "min_clearance_m", "collisions", "replans",
        "final_error_m", "final_sigma_m", "collision_list", "nearest"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  for (const char* key : {"t", "from", "to", "event", "cause"}) {
    EXPECT_TRUE(json.at("transitions").at(0).contains(key)) << key;
  }
  const Ran replayed = run_here("replay --json a.lcmlog");
  EXPECT_EQ(replayed.status, 0) << replayed.err;
  const auto report = nlohmann::json::parse(replayed.out);
  EXPECT_TRUE(report.at("identical").get<bool>());
  EXPECT_TRUE(report.at("first_divergence").is_null());
  EXPECT_GT(report.at("events").get<int>(), 10'000);
}

TEST(Command, ADamagedLogIsNotIdentical) {
  ASSERT_EQ(run_here("run --seed 3 --log a.lcmlog " + kWindow).status, 0);
  const std::filesystem::path path = own_folder() / "a.lcmlog";
  const auto damage_at = [&](std::uintmax_t offset) {
    std::fstream log(path, std::ios::binary | std::ios::in | std::ios::out);
    log.seekg(static_cast<std::streamoff>(offset));
    const int byte = log.get();
    log.seekp(static_cast<std::streamoff>(offset)).put(static_cast<char>(byte ^ 4));
  };
  const std::uintmax_t third = std::filesystem::file_size(path) / 3;
  damage_at(third);
  const Ran replayed = run_here("replay --json a.lcmlog");
  EXPECT_EQ(replayed.status, 1);
  const auto report = nlohmann::json::parse(replayed.out);
  EXPECT_FALSE(report.at("identical").get<bool>());
  EXPECT_TRUE(report.at("first_divergence").is_null());
  EXPECT_FALSE(report.at("torn").get<bool>());
  ASSERT_EQ(report.at("gaps").size(), 1U);
  const auto gap = report.at("gaps").at(0);
  EXPECT_NEAR(gap.at("to_s").get<double>() - gap.at("from_s").get<double>(), 0.04, 1e-6);
  EXPECT_LE(gap.at("offset").get<std::uintmax_t>(), third);
  EXPECT_GT(gap.at("offset").get<std::uintmax_t>() + gap.at("bytes").get<std::uintmax_t>(), third);
  EXPECT_LT(gap.at("bytes").get<std::uintmax_t>(), 10'000U);
  const Ran in_words = run_here("replay a.lcmlog");
  EXPECT_EQ(in_words.status, 1);
  EXPECT_THAT(in_words.out, HasSubstr("DAMAGED"));
  EXPECT_THAT(in_words.out, HasSubstr("gap from"));
  const Ran explained = run_here("explain a.lcmlog");
  EXPECT_EQ(explained.status, 0);
  EXPECT_THAT(explained.out, HasSubstr("the log is damaged: nothing is known from"));
  EXPECT_THAT(explained.out, HasSubstr("surfaced")) << "what follows the gap is explained";

  damage_at(200);  // In the header.
  const Ran headless = run_here("replay --json a.lcmlog");
  EXPECT_EQ(headless.status, 1);
  EXPECT_EQ(nlohmann::json::parse(headless.out).at("gaps").size(), 2U);
  EXPECT_FALSE(nlohmann::json::parse(headless.out).at("identical").get<bool>());
  EXPECT_EQ(run_here("replay a.lcmlog --mission " + kWindow).status, 2);
  EXPECT_EQ(nlohmann::json::parse(run_here("explain --json a.lcmlog").out).at("gaps").size(), 2U);
}

TEST(Command, RunShowsWhereItIsAndEndsWithAVerdict) {
  const Ran ran = run_here("run --log a.lcmlog " + kWindow);
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("in -> room_b"));
  EXPECT_THAT(ran.err, HasSubstr("depth"));
  EXPECT_THAT(ran.err, HasSubstr("clearance"));
  EXPECT_THAT(ran.out, StartsWith("SUCCESS"));
  EXPECT_THAT(ran.out, HasSubstr("log a.lcmlog"));
  EXPECT_EQ(ran.err.find('\033'), std::string::npos) << "no escape codes into a file";
}

TEST(Command, AnAbortedDiveIsOne) {
  const Ran ran = run_here("run --json --leak-at 20 --log a.lcmlog " + kWindow);
  EXPECT_EQ(ran.status, 1);
  EXPECT_EQ(nlohmann::json::parse(ran.out).at("outcome"), "aborted");
  EXPECT_EQ(run_here("replay a.lcmlog").status, 0) << "an aborted dive replays as well";
}

TEST(Command, AFullDiskLosesTheLogNotTheDive) {
  // A limit on file size simulates a full disk; its signal is ignored.
  // The journal, which is allocated before the dive, is smaller than the limit.
  const Ran ran =
      run_here("run --json --log a.lcmlog " + kWindow, "trap '' XFSZ; ulimit -f 4100; ");
  EXPECT_EQ(ran.status, 0) << "the dive was one";
  EXPECT_EQ(nlohmann::json::parse(ran.out).at("final_state"), "surfaced");
  EXPECT_THAT(ran.err, HasSubstr("not complete"));
  EXPECT_THAT(ran.err, HasSubstr("File too large"));
  const Ran replayed = run_here("replay --json a.lcmlog");
  EXPECT_EQ(replayed.status, 1);
  const auto report = nlohmann::json::parse(replayed.out);
  EXPECT_FALSE(report.at("identical").get<bool>()) << "the log must not look complete";
  EXPECT_EQ(report.at("first_divergence"), nullptr) << "what is there is whole";
}

// A box of 4 x 3 x 2 m whose top is 9 m deep: closed, with known values.
std::string box_map(const std::string& pose) {
  return "printf 'v -2 -1.5 -1\\nv 2 -1.5 -1\\nv -2 1.5 -1\\nv 2 1.5 -1\\nv -2 -1.5 1\\nv 2 -1.5 "
         "1\\nv -2 1.5 "
         "1\\nv 2 1.5 1\\nf 1 3 2\\nf 2 3 4\\nf 5 6 7\\nf 6 8 7\\nf 1 2 5\\nf 2 6 5\\nf 3 7 4\\nf "
         "4 7 8\\nf 1 "
         "5 3\\nf 3 5 7\\nf 2 4 6\\nf 4 8 6\\n' > box.obj && "
         "echo \"<sdf version='1.6'><model name='m'><static>1</static><pose>" +
         pose +
         "</pose><link name='l'><collision name='c'><geometry><mesh><uri>box.obj</uri></mesh>"
         "</geometry></collision></link></model></sdf>\" > map.sdf && ";
}

TEST(Command, PlanStatesTheExtentsOfMeshes) {
  const std::string poses = " --start -8,0,-5 --goal 8,0,-5";
  const Ran ran = run_here("plan --map map.sdf --json" + poses, box_map("0 0 -10 0 0 0"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.err, Not(HasSubstr("warning")));
  const auto meshes = nlohmann::json::parse(ran.out).at("meshes");
  ASSERT_EQ(meshes.size(), 1U);
  EXPECT_EQ(meshes[0].at("name"), "m/l/c");
  EXPECT_EQ(meshes[0].at("file"), "box.obj");
  EXPECT_EQ(meshes[0].at("triangles"), 12);
  EXPECT_EQ(meshes[0].at("extent_m"), nlohmann::json({4.0, 3.0, 2.0}));
  EXPECT_EQ(meshes[0].at("top_z_m"), -9.0);
  EXPECT_EQ(meshes[0].at("bottom_z_m"), -11.0);
  EXPECT_NEAR(meshes[0].at("volume_m3").get<double>(), 24.0, 1e-9);
  EXPECT_EQ(meshes[0].at("closed"), true);
  const Ran text = run_here("plan --map map.sdf" + poses, box_map("0 0 -10 3.14159 0 0"));
  EXPECT_THAT(text.out, HasSubstr("m/l/c: 12 triangles, 4.00 x 3.00 x 2.00 m, z from -11.00 to "
                                  "-9.00 m, 24 m3"));
  EXPECT_THAT(text.err, HasSubstr("MAP-MESH-UPSIDE-DOWN"));
}

TEST(Command, CheckStatesTheExtentsOfMeshes) {
  const std::string mission = std::string("sed 's#maps/window.sdf#map.sdf#' ") + kWindow +
                              " > mission.xml && " + box_map("0 0 -30 0 0 0");
  const Ran ran = run_here("check --static --json mission.xml", mission);
  const auto meshes = nlohmann::json::parse(ran.out).at("meshes");
  ASSERT_EQ(meshes.size(), 1U) << ran.out;
  EXPECT_EQ(meshes[0].at("top_z_m"), -29.0);
  EXPECT_THAT(run_here("check --static mission.xml", mission).out,
              HasSubstr("mesh   m/l/c: 12 tri"));
}

}  // namespace
}  // namespace dive::mission
