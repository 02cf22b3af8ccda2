// The main mission, end to end, through the same functions that the commands use.

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/mathematics.h"
#include "mission/check/check.h"
#include "mission/cli/loading.h"
#include "mission/record/log.h"
#include "mission/record/replay.h"
#include "mission/simulation/simulated_dive.h"
#include "test/common/file_content.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using dive::testing::content_of;
using ::testing::HasSubstr;

const LoadedMission& window() {
  static const LoadedMission loaded = [] {
    Diagnostics diagnostics;
    auto result = load(std::string(DIVE_SOURCE_DIR) + "/missions/window.xml",
                       planning::Resources::kInFolder, diagnostics);
    for (const Diagnostic& diagnostic : diagnostics.list()) {
      ADD_FAILURE() << render(diagnostic, false);
    }
    return std::move(*result);
  }();
  return loaded;
}

DiveResult dive_and_log(const DiveSettings& settings, const fs::path& path,
                        const std::string& mission_xml = window().mission.source.content()) {
  LogHeader header;
  header.version = "test";
  header.mathematics = mathematics();
  header.seed = settings.seed;
  header.mission_name = "window.xml";
  header.mission_xml = mission_xml;
  header.map_name = window().mission.map_file.value;
  header.map_xml = window().map.content();
  header.vehicle_urdf = vehicle::aqua2_urdf().content();
  auto log = LogWriter::create(path.string(), header);
  EXPECT_TRUE(log.has_value());
  DiveResult result = simulate_dive(
      window().mission, window().world, window().model, settings,
      [&](const StepInputs& inputs, const StepOutputs& outputs, const vehicle::GroundTruth& truth,
          const auto&) {
        EXPECT_TRUE(log->write(inputs, outputs, TruthRecord{truth.utime, truth.X_WB}));
      });
  EXPECT_TRUE(log->close());
  return result;
}

class WindowDive : public ::testing::TestWithParam<int> {};

// The acceptance criteria of the mission: ground truth, on every seed, and a log that replays.
TEST_P(WindowDive, EndsSurfacedWithClearanceAndReplaysIdentically) {
  DiveSettings settings;
  settings.seed = static_cast<std::uint64_t>(GetParam());
  const fs::path path =
      fs::path(::testing::TempDir()) / ("window-" + std::to_string(GetParam()) + ".lcmlog");
  const DiveResult result = dive_and_log(settings, path);
  EXPECT_EQ(result.outcome, "success") << result.cause;
  EXPECT_EQ(result.final_state, "surfaced");
  EXPECT_TRUE(result.collisions.empty());
  EXPECT_GE(result.nearest.clearance_m, 0.5);
  EXPECT_LT(result.final_depth_m, 0.5);
  EXPECT_LT(result.final_error_m, 3.5 * result.final_sigma_m);

  auto log = LogReader::open(path.string());
  ASSERT_TRUE(log.has_value()) << log.error();
  const auto report = replay(*log);
  ASSERT_TRUE(report.has_value()) << report.error();
  EXPECT_TRUE(report->identical) << report->first_divergence;
  EXPECT_NEAR(static_cast<double>(report->ticks), result.duration_s * 50.0, 1.5);
  fs::remove(path);
}

INSTANTIATE_TEST_SUITE_P(Seeds, WindowDive, ::testing::Range(1, 21));

TEST(Window, SameSeedSameLogByteForByte) {
  const fs::path a = fs::path(::testing::TempDir()) / "same-a.lcmlog";
  const fs::path b = fs::path(::testing::TempDir()) / "same-b.lcmlog";
  const fs::path c = fs::path(::testing::TempDir()) / "other.lcmlog";
  DiveSettings settings;
  dive_and_log(settings, a);
  dive_and_log(settings, b);
  settings.seed = 2;
  dive_and_log(settings, c);
  EXPECT_TRUE(content_of(a) == content_of(b));
  EXPECT_FALSE(content_of(a) == content_of(c));
}

TEST(Window, ASignalIsAnAbortAndReplays) {
  const fs::path path = fs::path(::testing::TempDir()) / "window-signal.lcmlog";
  DiveSettings settings;
  int ticks = 0;
  settings.local_abort = [&ticks] {
    return ++ticks == 1000 ? std::optional(OperatorCommand::kSigint) : std::nullopt;
  };
  const DiveResult result = dive_and_log(settings, path);
  EXPECT_EQ(result.outcome, "aborted");
  EXPECT_EQ(result.cause, "failsafe operator_abort: SIGINT to the executive");
  auto log = LogReader::open(path.string());
  ASSERT_TRUE(log.has_value()) << log.error();
  const auto report = replay(*log);
  ASSERT_TRUE(report.has_value()) << report.error();
  EXPECT_TRUE(report->identical) << report->first_divergence;
}

TEST(Window, AReplayAgainstAnotherMissionNamesTheFirstDifference) {
  const fs::path path = fs::path(::testing::TempDir()) / "window-changed.lcmlog";
  std::string slower = window().mission.source.content();
  const std::size_t at = slower.find("speed=\"0.4\"");
  ASSERT_NE(at, std::string::npos);
  slower.replace(at, 11, "speed=\"0.3\"");
  dive_and_log({}, path, slower);
  auto log = LogReader::open(path.string());
  ASSERT_TRUE(log.has_value()) << log.error();
  const auto report = replay(*log);
  ASSERT_TRUE(report.has_value()) << report.error();
  EXPECT_FALSE(report->identical);
  EXPECT_THAT(report->first_divergence, HasSubstr("logged"));
  EXPECT_THAT(report->first_divergence, HasSubstr("t = "));
}

TEST(Window, ADamagedHeaderIsAGap) {
  const fs::path path = fs::path(::testing::TempDir()) / "window-damaged.lcmlog";
  dive_and_log({}, path);
  std::string bytes = content_of(path);
  const std::size_t at = bytes.find("speed=\"0.4\"");
  ASSERT_NE(at, std::string::npos);
  bytes[at + 9] = '3';
  std::ofstream(path, std::ios::binary) << bytes;
  const auto log = LogReader::open(path.string());
  ASSERT_TRUE(log.has_value()) << log.error();
  EXPECT_FALSE(log->header().has_value()) << "nothing is replayed with a mission that was altered";
}

TEST(Window, ALeakInTheFarRoomSurfacesOutside) {
  DiveSettings settings;
  settings.faults = {{FaultKind::kLeak, 40.0}};
  Eigen::Vector3d end_W;
  const DiveResult result =
      simulate_dive(window().mission, window().world, window().model, settings,
                    [&](const StepInputs&, const StepOutputs&, const vehicle::GroundTruth& truth,
                        const auto&) { end_W = truth.X_WB.p; });
  EXPECT_EQ(result.outcome, "aborted");
  EXPECT_EQ(result.final_state, "dive.aborted");
  EXPECT_THAT(result.cause, HasSubstr("leak"));
  EXPECT_TRUE(result.collisions.empty());
  EXPECT_LT(result.final_depth_m, 0.5);
  EXPECT_LT(end_W.x(), 0.0) << "outside of the roof, which starts at x = 0";
}

TEST(Window, CheckFindsItReadyAndPrintsItsBudget) {
  CheckOptions options;
  options.simulate = false;
  Diagnostics diagnostics;
  CheckObserver observer;
  SteadyClock clock;
  const CheckReport report = check_mission(window().mission, window().world, window().model,
                                           options, diagnostics, observer, clock);
  EXPECT_TRUE(diagnostics.ok());
  ASSERT_EQ(report.legs.size(), 3U);
  for (const PlannedRouteLeg& leg : report.legs) EXPECT_GE(leg.plan.clearance_m, 1.0) << leg.goal;
  EXPECT_GE(report.legs[1].plan.warm_starts, 1);
  EXPECT_TRUE(report.exit_path.exists);
  EXPECT_GT(report.exit_path.longest_m, 9.8);
  EXPECT_GE(report.exit_path.clearance_m, 0.9);
  EXPECT_GT(report.budget.distance_m, 28.0);
  EXPECT_LT(report.budget.distance_m, 45.0);
  EXPECT_GT(report.budget.duration_s, report.budget.distance_m / 0.4);
}

std::vector<std::string> codes_of_check(const Mission& mission) {
  CheckOptions options;
  options.simulate = false;
  Diagnostics diagnostics;
  CheckObserver observer;
  SteadyClock clock;
  const CheckReport report =
      check_mission(mission, window().world, window().model, options, diagnostics, observer, clock);
  EXPECT_FALSE(report.dive.has_value());
  std::vector<std::string> codes;
  for (const Diagnostic& diagnostic : diagnostics.list()) codes.push_back(diagnostic.code);
  return codes;
}

TEST(Window, CheckWarnsOfWhatCannotWork) {
  Mission mission = window().mission;
  mission.limits.mission_timeout.value = 60.0;
  mission.limits.battery_reserve.value = 0.999;
  const std::vector<std::string> codes = codes_of_check(mission);
  EXPECT_THAT(codes, ::testing::IsSupersetOf({"CHK-TIME", "CHK-ENERGY"}));
}

// From under an overhead to open water: valid except for the exit path, which is not behind the
// vehicle.
TEST(Check, RefusesADiveThatStartsWithoutAWayOut) {
  constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="outwards">
    <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
    <map file="none.sdf"/>
    <start x="5" y="0" z="4" z_units="DEPTH" heading_deg="270"/>
    <limits max_depth="8" min_altitude="0.3" clearance="0.6" mission_timeout="300"
            battery_reserve="0.2"/>
    <states initial="leave">
      <goto id="leave" x="-5" y="0" z="4" z_units="DEPTH" timeout="100" on_timeout="leave">
        <transition event="done.state.leave" target="ascend"/>
      </goto>
      <surface id="ascend">
        <transition event="done.state.ascend" target="surfaced"/>
      </surface>
      <final id="surfaced"/>
    </states>
  </mission>)";
  Diagnostics diagnostics;
  const auto mission =
      parse_mission(SourceText("outwards.xml", kMission), diagnostics, MapFile::kNotNeeded);
  ASSERT_TRUE(mission) << render(diagnostics.list().at(0), false);
  planning::World world;
  world.obstacles.push_back({"roof", planning::Box{{20, 20, 1}}, Pose{{10, 0, -1.5}}});
  CheckOptions options;
  options.simulate = false;
  CheckObserver observer;
  SteadyClock clock;
  const CheckReport report =
      check_mission(*mission, world, window().model, options, diagnostics, observer, clock);
  EXPECT_FALSE(report.exit_path.exists);
  ASSERT_FALSE(diagnostics.ok());
  EXPECT_EQ(diagnostics.list().back().code, "CHK-NO-EXIT-PATH");
}

}  // namespace
}  // namespace dive::mission
