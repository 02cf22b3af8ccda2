// Results of every command: nothing is overwritten, no input is an output, and what could not be
// written is said. Files of inputs: none can stop a command.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using testing::content_of;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::own_folder;
using testing::Ran;
using testing::run_here;
using testing::write_here;

const fs::path kMissions = fs::path(DIVE_SOURCE_DIR) / "missions";

// Two waypoints for QGroundControl.
const std::string kForeign =
    "QGC WPL 110\n1\t0\t3\t16\t0\t0\t0\t0\t47.0\t-122.0\t-2\t1\n"
    "2\t0\t3\t16\t0\t0\t0\t0\t47.0005\t-121.9995\t-3\t1\n";

/// `redirection`: of standard output, e.g. ">/dev/full".
Ran run_redirected(const std::string& arguments, const std::string& redirection = {}) {
  const std::string setup = "timeout 120 sh -c '\"$0\" \"$@\" " + redirection + "'";
  return run_here(arguments, setup);
}

std::string content(const std::string& name) { return content_of(own_folder() / name); }

/// Surfaces from 1 m: drawing each picture of a recorded dive takes longer than the dive.
const std::string kShortMission =
    R"(<mission xmlns="urn:dive:mission:1" id="short">
  <vehicle model="aqua2" speed="0.4"/>
  <map file="maps/bay.sdf"/>
  <start x="0" y="0" z="1" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="6" min_altitude="1" clearance="0.6" mission_timeout="60" battery_reserve="0.3"/>
  <estimation estimator="primitive"/>
  <states initial="up">
    <surface id="up"><transition event="done.state.up" target="surfaced"/></surface>
    <final id="surfaced"/>
  </states>
</mission>
)";

/// A mission, m.xml, with its map; a shorter one, short.xml; a map alone, a scenario, a dataset and
/// a foreign mission.
void write_inputs() {
  write_here("m.xml", content_of(kMissions / "scenarios/missions/dart.xml"));
  write_here("short.xml", kShortMission);
  fs::create_directories(own_folder() / "maps");
  for (const auto& entry : fs::directory_iterator(kMissions / "scenarios/missions/maps")) {
    fs::copy_file(entry.path(), own_folder() / "maps" / entry.path().filename(),
                  fs::copy_options::overwrite_existing);
  }
  write_here("map.sdf", content_of(kMissions / "maps/window.sdf"));
  write_here("s.xml",
             "<scenario xmlns=\"urn:dive:scenario:1\" id=\"s\" mission=\"m.xml\">\n"
             "<expect><outcome is=\"success\"/></expect></scenario>\n");
  write_here("line.plan", kForeign);
  const std::string unit = "T_BS:\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";
  std::string imu;
  std::string images;
  std::string depth;
  for (long k = 1; k <= 400; ++k) {
    imu += fmt::format("{},0,0,0,0,0,9.81\n", 5'000'000 * k);
    if (k % 10 != 0) continue;
    images += fmt::format("{},{}.png\n", 5'000'000 * k, k);
    depth += fmt::format("{},2.0\n", 5'000'000 * k);
  }
  write_here("data/imu0/sensor.yaml", unit);
  write_here("data/imu0/data.csv", imu);
  write_here("data/cam0/sensor.yaml",
             unit +
                 "resolution: [752, 480]\nintrinsics: [400, 400, 376, 240]\n"
                 "distortion_coefficients: [0, 0, 0, 0]\n");
  write_here("data/cam0/data.csv", images);
  write_here("data/depth0/data.csv", depth);
}

/// One option that names a result. In `command` {} stands for the name of the result.
struct ResultOption {
  const char* name;
  const char* command;
  const char* file;   ///< The file that is written if {} is "result".
  const char* input;  ///< A file that the command reads; empty if it reads none.
};

std::ostream& operator<<(std::ostream& out, const ResultOption& option) {
  return out << option.name;
}

const ResultOption kOptions[] = {
    {"plan_svg", "plan m.xml --svg {}", "result", "m.xml"},
    {"plan_map_svg", "plan --map map.sdf --start -1,-2,-4 --goal 9.8,-2,-4.6 --svg {}", "result",
     "map.sdf"},
    {"check_card", "check m.xml --static --card {}", "result", "m.xml"},
    {"check_card_map", "check m.xml --static --card {}", "result", "maps/bay.sdf"},
    {"run_svg", "run m.xml --log run.lcmlog --svg {}", "result", "m.xml"},
    {"run_svg_map", "run m.xml --log run.lcmlog --svg {}", "result", "maps/bay.sdf"},
    {"run_log", "run m.xml --journal run.journal --log {}", "result", "m.xml"},
    {"run_journal", "run m.xml --log run.lcmlog --journal {}", "result", "m.xml"},
    {"run_record", "run short.xml --log run.lcmlog --record {}", "result/mav0/imu0/data.csv", ""},
    {"sim_calibration", "sim m.xml --simulated-water clear_pool --write-calibration {}",
     "result/imu0/sensor.yaml", ""},
    {"test_junit", "test s.xml --junit {}", "result", "s.xml"},
    {"test_junit_mission", "test s.xml --junit {}", "result", "m.xml"},
    {"graph", "graph m.xml --output {}", "result", "m.xml"},
    {"report_plan", "report m.xml --output {}", "result", "m.xml"},
    {"report_plan_map", "report m.xml --output {}", "result", "maps/bay.sdf"},
    {"estimate", "estimate data --estimator primitive --output {}", "result", "data/imu0/data.csv"},
    {"import_mission", "import qgc line.plan --depth 2 --output {}", "result/line.xml", ""},
    {"key", "key {}", "result", ""},
};

class OutputOption : public ::testing::TestWithParam<ResultOption> {
 protected:
  static Ran dive_to(const std::string& result, const std::string& more = {}) {
    return run_redirected(fmt::format(fmt::runtime(GetParam().command), result) + more);
  }
};

TEST_P(OutputOption, IsReplacedOnlyByForce) {
  write_inputs();
  write_here(GetParam().file, "of yesterday");
  const Ran refused = dive_to("result");
  EXPECT_EQ(refused.status, 2) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("result"));
  EXPECT_THAT(refused.err, HasSubstr("--force"));
  EXPECT_THAT(refused.err, HasSubstr("already"));
  EXPECT_EQ(content(GetParam().file), "of yesterday");
  EXPECT_FALSE(fs::exists(own_folder() / "run.lcmlog")) << "what is refused leaves nothing";

  const Ran forced = dive_to("result", " --force");
  EXPECT_LE(forced.status, 1) << forced.err;
  EXPECT_NE(content(GetParam().file), "of yesterday");
  EXPECT_FALSE(content(GetParam().file).empty());
}

TEST_P(OutputOption, MakesItsFolder) {
  write_inputs();
  fs::remove_all(own_folder() / "made");
  const Ran ran = dive_to("made/here/result");
  EXPECT_LE(ran.status, 1) << ran.err;
  EXPECT_TRUE(fs::exists(own_folder() / "made/here" / GetParam().file)) << ran.err;
}

TEST_P(OutputOption, IsNeverAnInput) {
  if (*GetParam().input == '\0') GTEST_SKIP() << "this command reads no file, or writes a folder";
  write_inputs();
  const std::string before = content(GetParam().input);
  ASSERT_FALSE(before.empty());
  fs::remove(own_folder() / "symlink");
  fs::remove(own_folder() / "hardlink");
  fs::create_symlink(GetParam().input, own_folder() / "symlink");
  fs::create_hard_link(own_folder() / GetParam().input, own_folder() / "hardlink");
  for (const std::string& name :
       {std::string(GetParam().input), "./" + std::string(GetParam().input), std::string("symlink"),
        std::string("hardlink")}) {
    for (const char* force : {"", " --force"}) {
      const Ran ran = dive_to(name, force);
      EXPECT_EQ(ran.status, 2) << name << force;
      EXPECT_THAT(ran.err, HasSubstr(name + ": is an input")) << force;
      EXPECT_EQ(content(GetParam().input), before) << name << force;
    }
  }
}

TEST_P(OutputOption, SaysWhatCouldNotBeWritten) {
  write_inputs();
  std::string full = "/dev/full";
  if (GetParam().file != std::string("result")) {  // a folder: its file is on a full disk
    if (GetParam().name == std::string("run_record")) GTEST_SKIP() << "a dataset is always new";
    full = GetParam().file;
    fs::create_directories((own_folder() / full).parent_path());
    fs::create_symlink("/dev/full", own_folder() / full);
  }
  const Ran ran = dive_to(full == "/dev/full" ? full : "result");
  EXPECT_EQ(ran.status, 3) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr(full));
  if (GetParam().name == std::string("run_journal")) return;  // its writer gives no reason
  EXPECT_THAT(ran.err, HasSubstr("No space left on device"));
}

INSTANTIATE_TEST_SUITE_P(Each, OutputOption, ::testing::ValuesIn(kOptions),
                         [](const auto& case_info) { return case_info.param.name; });

TEST(Output, StandardOutputThatCannotBeWrittenIsThree) {
  write_inputs();
  ASSERT_EQ(run_redirected("run m.xml --log run.lcmlog").status, 0);
  for (const std::string command :
       {"check --static m.xml --json", "check --rules --json", "plan m.xml --json", "graph m.xml",
        "test s.xml --json", "replay run.lcmlog --json", "explain run.lcmlog --json",
        "estimate data --estimator primitive --json", "run m.xml --json --log other.lcmlog",
        "import qgc line.plan --depth 2 --output imported --json", "key topside.key", "--help",
        "sim m.xml --simulated-water clear_pool --write-calibration cameras --json"}) {
    for (const std::string to : {">/dev/full", ">&-"}) {
      const Ran ran = run_redirected(command + (command[0] == '-' ? "" : " "), to);
      if (to == ">&-" && ran.status == 2) continue;  // what the first run wrote exists
      EXPECT_EQ(ran.status, 3) << command << to << ran.err;
      EXPECT_THAT(ran.err, HasSubstr("standard output: cannot be written")) << command << to;
    }
  }
}

// --- log and journal ---

TEST(Output, LogsThatAreNotNamedCountUp) {
  write_inputs();
  for (const char* name : {"dart-seed7.lcmlog", "dart-seed7-2.lcmlog", "dart-seed7-3.lcmlog"}) {
    const Ran ran = run_redirected("run m.xml --seed 7 --json");
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(nlohmann::json::parse(ran.out).at("log"), std::string("dive-runs/") + name);
    EXPECT_TRUE(fs::exists(own_folder() / "dive-runs" / (std::string(name) + ".journal")));
    EXPECT_EQ(run_redirected(std::string("replay dive-runs/") + name).status, 0);
  }
}

TEST(Output, ADiveThatIsResumedKeepsItsFirstLog) {
  write_inputs();
  ASSERT_EQ(run_redirected("run m.xml --log a.lcmlog").status, 0);
  const std::string first = content("a.lcmlog");
  const Ran resumed = run_redirected("run m.xml --log a.lcmlog --resume --json");
  EXPECT_LE(resumed.status, 1) << resumed.err;
  EXPECT_EQ(content("a.lcmlog"), first);
  EXPECT_EQ(nlohmann::json::parse(resumed.out).at("log"), "a-2.lcmlog");
  EXPECT_FALSE(fs::exists(own_folder() / "a-2.lcmlog.journal"))
      << "the journal is that of the dive";
  EXPECT_LE(
      run_redirected("run m.xml --journal a.lcmlog.journal --log a.lcmlog --resume --force").status,
      1);
  EXPECT_EQ(content("a.lcmlog"), first) << "not even by force";
  EXPECT_TRUE(fs::exists(own_folder() / "a-3.lcmlog"));

  // Without names it is the newest dive.
  ASSERT_EQ(run_redirected("run m.xml --seed 4").status, 0);
  ASSERT_EQ(run_redirected("run m.xml --seed 4").status, 0);
  fs::remove(own_folder() / "dive-runs/dart-seed4.lcmlog.journal");
  const Ran newest = run_redirected("run m.xml --seed 4 --resume --json");
  EXPECT_LE(newest.status, 1) << newest.err;
  EXPECT_EQ(nlohmann::json::parse(newest.out).at("log"), "dive-runs/dart-seed4-3.lcmlog");
}

TEST(Output, TwoDivesWriteNeitherOneLogNorOneJournal) {
  write_inputs();
  ASSERT_EQ(run_redirected("run m.xml --log a.lcmlog").status, 0);
  // flock holds the files as a dive does that has not ended.
  const auto while_locked = [](const std::string& file, const std::string& arguments) {
    const std::string setup = "flock " + file + " timeout 120";
    return run_here(arguments, setup);
  };
  const std::string journal = content("a.lcmlog.journal");
  for (const char* more : {" --log b.lcmlog --resume", " --log b.lcmlog --force"}) {
    const Ran ran = while_locked("a.lcmlog.journal.lock",
                                 std::string("run m.xml --journal a.lcmlog.journal") + more);
    EXPECT_EQ(ran.status, 2) << more;
    EXPECT_THAT(ran.err, HasSubstr("a.lcmlog.journal: another dive is writing this journal"));
    EXPECT_EQ(content("a.lcmlog.journal"), journal) << more;
    EXPECT_FALSE(fs::exists(own_folder() / "b.lcmlog"));
  }
  const std::string log = content("a.lcmlog");
  const Ran ran = while_locked("a.lcmlog", "run m.xml --log a.lcmlog --force");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("a.lcmlog: another process, or another option, is writing to it"));
  EXPECT_EQ(content("a.lcmlog"), log);
  EXPECT_EQ(run_redirected("run m.xml --log one --svg one").status, 2) << "two results in one file";
}

TEST(Output, AMapThatWasMadeOnADiveCountsUp) {
  write_inputs();
  write_here("murk.xml", content_of(kMissions / "scenarios/missions/murk.xml"));
  const auto box = [](const char* name, const char* at, const char* size) {
    return fmt::format(
        "<model name='{}'><static>1</static><pose>{} 0 0 0</pose><link name='l'><collision "
        "name='c'><geometry><box><size>{}</size></box></geometry></collision></link></model>",
        name, at, size);
  };
  write_here("maps/bay.sdf", "<sdf version='1.6'><world name='bay'>" +
                                 box("seabed", "0 0 -6.5", "60 60 1") +
                                 box("post", "3.5 0.2 -3", "1 1 6") + "</world></sdf>");
  for (const char* name : {"a.map.sdf", "a-2.map.sdf"}) {
    fs::remove(own_folder() / "a.lcmlog");
    fs::remove(own_folder() / "a.lcmlog.journal");
    const Ran ran = run_redirected("run murk.xml --log a.lcmlog --json");
    ASSERT_LE(ran.status, 1) << ran.err;
    EXPECT_EQ(nlohmann::json::parse(ran.out).at("map"), name);
  }
}

TEST(Output, LogsOfScenariosCountUp) {
  write_inputs();
  ASSERT_EQ(run_redirected("test s.xml s.xml --keep kept --keep-all").status, 0);
  ASSERT_EQ(run_redirected("test s.xml --keep kept --keep-all").status, 0);
  for (const char* name : {"s.lcmlog", "s-2.lcmlog", "s-3.lcmlog"}) {
    EXPECT_EQ(run_redirected(std::string("replay kept/") + name).status, 0) << name;
  }
}

TEST(Output, OfAnImportIsNotTheFileThatIsImported) {
  write_here("line.xml", kForeign);
  const Ran ran = run_redirected("import qgc line.xml --depth 2 --force");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("line.xml: is an input"));
  EXPECT_EQ(content("line.xml"), kForeign);
}

// --- inputs ---

TEST(Input, SpecialFilesAreRefusedAtOnce) {
  write_inputs();
  ASSERT_EQ(run_redirected("key k").status, 0);
  const auto as_pipe = [](const std::string& name) {
    fs::remove(own_folder() / name);
    ASSERT_EQ(::mkfifo((own_folder() / name).c_str(), 0600), 0);
  };
  as_pipe("pipe");
  const std::string link = " --lcm udpm://239.255.76.67:7667?ttl=0";
  const std::vector<std::string> commands{"check pipe",
                                          "plan pipe",
                                          "run pipe",
                                          "graph pipe",
                                          "sim pipe",
                                          "test pipe",
                                          "replay pipe",
                                          "explain pipe",
                                          "import acfr pipe",
                                          "import qgc pipe",
                                          "plan --map pipe --start 0,0,-2 --goal 1,0,-2",
                                          "plan --cloud pipe --start 0,0,-2 --goal 1,0,-2",
                                          "sim pipe --start 0,0,-2",
                                          "abort --key pipe" + link,
                                          "run m.xml --log a --key pipe" + link,
                                          "run m.xml --log a --journal pipe --resume",
                                          "replay pipe --mission m.xml"};
  for (const std::string& command : commands) {
    const Ran ran = run_redirected(command);
    EXPECT_EQ(ran.status, 2) << command << ran.err;
    EXPECT_THAT(ran.err, HasSubstr("is a pipe, not a regular file")) << command;
  }
  EXPECT_THAT(run_redirected("check /dev/zero").err, HasSubstr("is a device, not a regular file"));
  EXPECT_THAT(run_redirected("check maps").err, HasSubstr("is a directory"));
  const Ran piped = testing::run_dive("check /dev/stdin", own_folder().filename().string(),
                                      "echo '<mission/>' | sh -c '\"$0\" \"$@\" <&3' 3<&0");
  EXPECT_THAT(piped.err, HasSubstr("is a pipe, not a regular file"));

  for (const auto& [pipe, command] :
       {std::pair("maps/bay.sdf", "check --static m.xml"),
        {"m.xml", "test s.xml"},
        {"data/imu0/data.csv", "estimate data --estimator primitive"},
        {"data/cam0/sensor.yaml", "estimate data --estimator primitive"}}) {
    write_inputs();
    as_pipe(pipe);
    const Ran ran = run_redirected(command);
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_THAT(ran.err, HasSubstr("pipe")) << command;
    fs::remove(own_folder() / pipe);
  }
}

TEST(Input, MeshesOutsideOfTheFolderOfAMapNeedAnOption) {
  write_here(
      "secret/box.obj",
      "v -2 -1.5 -1\nv 2 -1.5 -1\nv -2 1.5 -1\nv 2 1.5 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n");
  write_here(
      "maps/map.sdf",
      "<sdf version='1.6'><model name='m'><static>1</static><pose>0 0 -10 0 0 0</pose>\n"
      "<link name='l'><collision name='c'><geometry><mesh><uri>../secret/box.obj</uri></mesh>\n"
      "</geometry></collision></link></model></sdf>\n");
  const std::string plan = "plan --map maps/map.sdf --start -8,0,-5 --goal 8,0,-5";
  const Ran ran = run_redirected(plan);
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("maps/map.sdf:2:"));
  EXPECT_THAT(ran.err, HasSubstr("MAP-OUTSIDE"));
  EXPECT_THAT(ran.err, HasSubstr("^"));
  EXPECT_THAT(ran.err, HasSubstr("--allow-outside"));
  EXPECT_EQ(run_redirected(plan + " --allow-outside").status, 0);
  EXPECT_THAT(run_redirected("sim maps/map.sdf --start -8,0,-5").err, HasSubstr("MAP-OUTSIDE"));

  std::string mission = content_of(kMissions / "scenarios/missions/dart.xml");
  mission.replace(mission.find("maps/"), mission.find(".sdf") - mission.find("maps/"), "maps/map");
  write_here("m.xml", mission);
  write_here("s.xml",
             "<scenario xmlns=\"urn:dive:scenario:1\" id=\"s\" mission=\"m.xml\">\n"
             "<expect><outcome is=\"success\"/></expect></scenario>\n");
  for (const std::string command :
       {"check --static m.xml", "plan m.xml", "run m.xml",
        "sim m.xml --simulated-water clear_pool --write-calibration c", "test s.xml"}) {
    EXPECT_THAT(run_redirected(command).err, HasSubstr("MAP-OUTSIDE")) << command;
    EXPECT_THAT(run_redirected(command + " --allow-outside").err, Not(HasSubstr("MAP-OUTSIDE")))
        << command;
  }
}

}  // namespace
}  // namespace dive::mission
