// dive check --bundle and dive run BUNDLE, as a field team uses them.

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mission/record/log.h"
#include "test/mission/cli/own_folder.h"
#include "vehicle/model.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::content_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::own_folder;
using testing::Ran;
using testing::run_here;

std::string shipped(const std::string& name) {
  return fmt::format("{}/missions/{}.xml", DIVE_SOURCE_DIR, name);
}
void write(const std::string& name, const std::string& text) {
  std::ofstream(own_folder() / name, std::ios::binary) << text;
}

LogHeader header_of(const std::string& log) {
  const auto reader = LogReader::open((own_folder() / log).string());
  EXPECT_TRUE(reader) << reader.error();
  return *reader->header();
}

/// The log after its first record, which holds the header.
std::string ticks_of(const std::string& log) {
  const std::string text = content_of(own_folder() / log);
  return text.substr(text.find("\xED\xA1\xDA\x01", 4));
}

/// Expects that a dive of the bundle is that of the mission, tick by tick.
void expect_same_dive(const std::string& mission, const std::string& bundle) {
  const Ran plain = run_here("run " + mission + " --seed 5 --log plain.lcmlog");
  const Ran verified = run_here("run " + bundle + " --seed 5 --log verified.lcmlog");
  EXPECT_EQ(plain.status, verified.status) << verified.err;
  EXPECT_THAT(verified.err, HasSubstr("verified: "));
  EXPECT_GT(ticks_of("plain.lcmlog").size(), 100'000U);
  EXPECT_TRUE(ticks_of("plain.lcmlog") == ticks_of("verified.lcmlog"));
}

TEST(BundleCommand, DivesAsTheMissionDoes) {
  ASSERT_EQ(run_here("check --static " + shipped("window") + " --bundle window.bundle").status, 0);
  expect_same_dive(shipped("window"), "window.bundle");
  EXPECT_THAT(header_of("verified.lcmlog").check, HasSubstr("bundle "));
  EXPECT_EQ(header_of("plain.lcmlog").check, "");
  EXPECT_THAT(run_here("replay verified.lcmlog").out, HasSubstr("identical"));
}

// Of a mission with fragments, in a folder without them, under a name that says otherwise.
TEST(BundleCommand, NeedsNoOtherFileAndNoName) {
  const std::string included =
      fmt::format("{}/test/mission/accepted/included.xml", DIVE_SOURCE_DIR);
  ASSERT_EQ(run_here("check --static " + included + " --bundle mission.xml").status, 0);
  const Ran run = run_here("run mission.xml --log dive.lcmlog");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(header_of("dive.lcmlog").mission_name, "included.xml");
}

// A mesh, and another world in the simulated dives.
TEST(BundleCommand, HoldsMeshesAndTheSimulatedWorld) {
  ASSERT_EQ(run_here("new goals mesh.xml").status, 0);
  std::string map = content_of(own_folder() / "mesh.sdf");
  write("box.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\n"
        "f 3 8 7\nf 4 1 5\nf 4 5 8\n");
  const auto with_box = [&map](double x) {
    std::string text = map;
    const std::string box = fmt::format(
        "<model name='crate'><static>true</static><pose>{} -9 -5 0 0 0</pose><link name='l'>"
        "<collision name='c'><geometry><mesh><uri>box.obj</uri></mesh></geometry></collision>"
        "</link></model>\n",
        x);
    return text.insert(text.rfind("</world>"), box);
  };
  write("mesh.sdf", with_box(2.0));
  write("simulated.sdf", with_box(2.1));
  std::string mission = content_of(own_folder() / "mesh.xml");
  const std::size_t at = mission.find("<map ") + 5;
  write("mesh.xml", mission.insert(at, "simulation_map=\"simulated.sdf\" "));
  const Ran checked = run_here("check --static mesh.xml --bundle mesh.bundle");
  ASSERT_EQ(checked.status, 0) << checked.out << checked.err;
  expect_same_dive("mesh.xml", "mesh.bundle");
}

TEST(BundleCommand, RefusesABundleThatWasChanged) {
  ASSERT_EQ(run_here("check --static " + shipped("window") + " --bundle window.bundle").status, 0);
  std::string bytes = content_of(own_folder() / "window.bundle");
  const std::size_t at = bytes.find("clearance=\"");
  ASSERT_NE(at, std::string::npos);
  bytes[at + 11] = '0';
  write("changed.bundle", bytes);
  const Ran run = run_here("run changed.bundle --json");
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.err, HasSubstr("BUNDLE-DAMAGED"));
  EXPECT_THAT(run.err, HasSubstr("dive check MISSION --bundle FILE"));
  EXPECT_EQ(json::parse(run.out).at("diagnostics").at(0).at("code"), "BUNDLE-DAMAGED");
  EXPECT_EQ(run_here("run changed.bundle --unchecked").status, 2);
}

TEST(BundleCommand, RefusesABundleOfAnotherVehicleUnlessUnchecked) {
  std::string urdf = vehicle::aqua2_urdf().content();
  const std::size_t at = urdf.find("<box size=\"") + 11;
  ASSERT_GT(at, 11U);
  write("wider.urdf", urdf.replace(at, 1, "1"));
  ASSERT_EQ(run_here("check --static " + shipped("pool1") + " --bundle pool1.bundle").status, 0);
  const Ran refused = run_here("run pool1.bundle --vehicle wider.urdf");
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, HasSubstr("BUNDLE-VEHICLE"));
  EXPECT_THAT(refused.err, HasSubstr("another hull"));

  const Ran unchecked =
      run_here("run pool1.bundle --vehicle wider.urdf --unchecked --log u.lcmlog");
  EXPECT_NE(unchecked.status, 2) << unchecked.err;
  EXPECT_THAT(unchecked.err, Not(HasSubstr("verified: ")));
  EXPECT_THAT(header_of("u.lcmlog").check, HasSubstr(", unchecked"));
}

TEST(BundleCommand, IsAcceptedWithTheKeyOfItsCode) {
  ASSERT_EQ(run_here("key one.key").status, 0);
  ASSERT_EQ(run_here("key two.key").status, 0);
  const std::string check = "check --static " + shipped("pool1") + " --bundle ";
  ASSERT_EQ(run_here(check + "coded.bundle --key one.key").status, 0);
  ASSERT_EQ(run_here(check + "plain.bundle").status, 0);
  const Ran right = run_here("run coded.bundle --key one.key");
  EXPECT_EQ(right.status, 0);
  EXPECT_THAT(right.err, HasSubstr("code made with this key"));
  EXPECT_THAT(run_here("run coded.bundle").err, HasSubstr("which only --key can verify"));
  const Ran wrong = run_here("run coded.bundle --key two.key");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_THAT(wrong.err, HasSubstr("another key"));
  const Ran plain = run_here("run plain.bundle --key one.key");
  EXPECT_EQ(plain.status, 2);
  EXPECT_THAT(plain.err, HasSubstr("dive check MISSION --bundle FILE --key KEY"));
  EXPECT_EQ(run_here("check --static " + shipped("pool1") + " --key one.key").status, 2)
      << "there is no bundle to make a code for";
  EXPECT_EQ(run_here(check + "more.bundle --key nowhere.key").status, 2);
}

TEST(BundleCommand, OverwritesNothingAndExistsOnlyForAMissionThatIsReady) {
  write("there.bundle", "mine");
  const std::string check = "check --static " + shipped("pool1") + " --bundle there.bundle";
  EXPECT_EQ(run_here(check).status, 2);
  EXPECT_EQ(content_of(own_folder() / "there.bundle"), "mine");
  EXPECT_EQ(run_here(check + " --force").status, 0);
  EXPECT_NE(content_of(own_folder() / "there.bundle"), "mine");

  // The way to the goal is longer than the mission may take.
  ASSERT_EQ(run_here("new goals late.xml").status, 0);
  std::string mission = content_of(own_folder() / "late.xml");
  const std::string limit = "mission_timeout=\"";
  const std::size_t at = mission.find(limit) + limit.size();
  ASSERT_GT(at, limit.size());
  mission.replace(at, mission.find('"', at) - at, "60");
  write("late.xml", mission);
  const Ran late = run_here("check --static late.xml --bundle late.bundle --json");
  EXPECT_EQ(late.status, 2);
  EXPECT_TRUE(json::parse(late.out).at("bundle").is_null());
  EXPECT_THAT(late.err, HasSubstr("no bundle is written"));
  EXPECT_FALSE(fs::exists(own_folder() / "late.bundle"));
}

// The other commands say what the file is.
TEST(BundleCommand, IsNeitherAMissionNorALog) {
  ASSERT_EQ(run_here("check --static " + shipped("pool1") + " --bundle pool1.bundle").status, 0);
  for (const char* command : {"check", "plan", "sim"}) {
    const Ran ran = run_here(fmt::format("{} pool1.bundle", command));
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_THAT(ran.err, HasSubstr("verified bundle")) << command;
  }
  for (const char* command :
       {"test pool1.bundle", "import acfr pool1.bundle", "import qgc pool1.bundle",
        "plan --map pool1.bundle --start 0,0,-1 --goal 1,0,-1", "sim pool1.bundle --start 0,0,-1",
        "export pool1.bundle --format kml"}) {
    const Ran ran = run_here(command);
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_THAT(ran.err, HasSubstr("this is a verified bundle")) << command;
    EXPECT_THAT(ran.err, Not(HasSubstr("XML"))) << command;
  }
  for (const char* command : {"replay", "explain"}) {
    const Ran ran = run_here(fmt::format("{} pool1.bundle", command));
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_THAT(ran.err, HasSubstr("this is a verified bundle, not a log")) << command;
  }
}

TEST(BundleCommand, IsDrawnAndReplayedAsItsMission) {
  const std::string pool1 = shipped("pool1");
  ASSERT_EQ(run_here("check --static " + pool1 + " --bundle pool1.bundle").status, 0);
  const Ran drawn = run_here("graph pool1.bundle --format scxml");
  EXPECT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_GT(drawn.out.size(), 1000U);
  EXPECT_EQ(drawn.out, run_here("graph " + pool1 + " --format scxml").out);

  ASSERT_EQ(run_here("run " + pool1 + " --log dive.lcmlog").status, 0);
  const Ran replayed = run_here("replay dive.lcmlog --mission pool1.bundle");
  EXPECT_EQ(replayed.status, 0) << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr("identical"));

  write("damaged.bundle", content_of(own_folder() / "pool1.bundle").substr(0, 5000));
  const Ran damaged = run_here("graph damaged.bundle");
  EXPECT_EQ(damaged.status, 2);
  EXPECT_THAT(damaged.err, HasSubstr("BUNDLE-DAMAGED"));
}

TEST(BundleCommand, ALogIsNoMission) {
  ASSERT_EQ(run_here("run " + shipped("pool1") + " --log dive.lcmlog").status, 0);
  for (const char* command : {"check dive.lcmlog", "graph dive.lcmlog", "plan dive.lcmlog",
                              "run dive.lcmlog", "test dive.lcmlog"}) {
    const Ran ran = run_here(command);
    EXPECT_EQ(ran.status, 2) << command;
    EXPECT_THAT(ran.err, HasSubstr("this is a log, not a ")) << command;
    EXPECT_THAT(ran.err, HasSubstr("dive explain, report, replay")) << command;
  }
}

TEST(BundleCommand, UncheckedIsRecorded) {
  const Ran run = run_here("run " + shipped("pool1") + " --unchecked --log u.lcmlog");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(header_of("u.lcmlog").check, "unchecked");
}

}  // namespace
}  // namespace dive::mission
