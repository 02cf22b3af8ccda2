// A mission with a tide table from file to log: checked, dived, and replayed without the table.

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/common/sanitizers.h"
#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

using testing::Ran;
using testing::run_dive;

// A copy of the scenario's mission, map and table.
fs::path copied(const std::string& name) {
  const fs::path folder = fs::path(::testing::TempDir()) / name;
  const fs::path from = DIVE_SOURCE_DIR "/missions/scenarios/missions";
  fs::remove_all(folder);
  fs::create_directories(folder / "maps");
  fs::create_directories(folder / "tides");
  for (const char* file : {"ferry.xml", "maps/bay.sdf", "tides/bay.csv"}) {
    fs::copy_file(from / file, folder / file);
  }
  return folder;
}

TEST(CurrentCommand, ALogIsReplayedWithoutTheTable) {
  DIVE_SKIP_UNDER_SANITIZERS("a dive of minutes");
  const fs::path folder = copied("current_replay");
  const std::string log = (folder / "dive.lcmlog").string();
  const Ran run =
      run_dive(fmt::format("run {} --seed 3 --log {} --json", (folder / "ferry.xml").string(), log),
               "current_run");
  ASSERT_EQ(run.status, 0) << run.err;
  fs::remove_all(folder / "tides");
  const Ran replay = run_dive(fmt::format("replay {} --json", log), "current_replay_out");
  EXPECT_EQ(replay.status, 0) << replay.err;
  const auto report = nlohmann::json::parse(replay.out);
  EXPECT_TRUE(report.at("identical").get<bool>()) << replay.out;
  EXPECT_GT(report.at("events").get<int>(), 1000);
}

TEST(CurrentCommand, CheckReportsTheLegsInTheCurrent) {
  const fs::path folder = copied("current_check");
  const std::string mission = (folder / "ferry.xml").string();
  const Ran good = run_dive(fmt::format("check --static --json {}", mission), "current_good");
  ASSERT_EQ(good.status, 0) << good.out << good.err;
  const auto plans = nlohmann::json::parse(good.out).at("plans");
  ASSERT_EQ(plans.size(), 3U);
  EXPECT_GT(plans[1].at("begins_s").get<double>(), 25.0);
  EXPECT_NEAR(plans[1].at("least_progress").at("share").get<double>(), 0.7, 0.1);

  std::ofstream(folder / "tides/bay.csv")
      << "time,speed,towards_deg\n09:00,0.45,180\n11:00,0.45,180\n";
  const Ran strong = run_dive(fmt::format("check --static {}", mission), "current_strong");
  EXPECT_EQ(strong.status, 2);
  EXPECT_NE(strong.err.find("[CHK-CURRENT]"), std::string::npos) << strong.err;
  EXPECT_NE(strong.err.find("ferry.xml:19:"), std::string::npos) << strong.err;
  EXPECT_NE(strong.err.find("^"), std::string::npos);

  std::ofstream(folder / "tides/bay.csv")
      << "time,speed,towards_deg\n09:00,0.1,180\nnoon,0.1,180\n";
  const Ran broken = run_dive(fmt::format("check --static {}", mission), "current_broken");
  EXPECT_EQ(broken.status, 2);
  EXPECT_NE(broken.err.find("bay.csv:3:1: error: 'noon' is not a time of day"), std::string::npos)
      << broken.err;
}

}  // namespace
}  // namespace dive::mission
