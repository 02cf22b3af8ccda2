// Visual-inertial dives round a basin, partly in the dark, with and without a tag on the wall where
// they turn.

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "mission/simulation/simulated_dive.h"
#include "planning/world/sdf.h"
#include "test/common/long_tests.h"
#include "test/common/sanitizers.h"
#include "vehicle/simulator/water/named_waters.h"

namespace dive::mission {
namespace {

using estimation::TagResult;

/// Where the mission below would be a file.
const std::string kFile = DIVE_SOURCE_DIR "/test/mission/simulation/round.xml";

const char* const kBack =
    R"(<goal id="back" x="1.8" y="1.2" z="1.8" z_units="DEPTH" capture_radius="0.4"/>
      <goal id="home" x="1.8" y="-1.2" z="1.8" z_units="DEPTH" capture_radius="0.4"/>
      <goal id="again" x="5" y="-1.2" z="1.8" z_units="DEPTH" capture_radius="0.4"/>)";

enum class Way { kToTheTurn, kRound };

std::string mission_text(const std::string& tag, Way way) {
  return fmt::format(R"(<mission xmlns="urn:dive:mission:1" id="round">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map file="maps/basin.sdf" simulated_water="clear_pool"/>
  <start x="1.5" y="-1.2" z="1.8" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="3.8" min_altitude="0.2" clearance="0.5"
          mission_timeout="400" battery_reserve="0.3"/>
  <estimation estimator="visual_inertial">{}</estimation>
  <states initial="swim">
    <goal_sequence id="swim" timeout="200" on_timeout="ascend">
      <goal id="turn" x="12" y="-1.2" z="1.8" z_units="DEPTH" capture_radius="0.4"/>
      <goal id="over" x="12" y="1.2" z="1.8" z_units="DEPTH" capture_radius="0.4"/>
      {}
      <transition event="done.state.swim plan.failed.swim" target="ascend"/>
    </goal_sequence>
    <surface id="ascend"><transition event="done.state.ascend" target="surfaced"/></surface>
    <final id="surfaced"/>
  </states>
</mission>)",
                     tag, way == Way::kRound ? kBack : "");
}

const std::string kTag =
    R"(<tag id="7" size="0.5" x="13.98" y="-1" z="2.7" z_units="DEPTH" heading_deg="270"/>)";
const std::string kTypo =
    R"(<tag id="7" size="0.5" x="13.98" y="-6" z="2.7" z_units="DEPTH" heading_deg="270"/>)";

struct DiveResults {
  DiveResult result;
  double after_turn_m = 0.0;  ///< Mean horizontal error from 26 s on, after the turn.
  double horizontal_m = 0.0;  ///< Horizontal error at the start of the ascent.
  double sigma_m = 0.0;       ///< Standard deviation of the estimate at that time.
  /// NEES of x and y, mean over the seconds with the visual-inertial estimator.
  double nees = 0.0;
  int used = 0;
  int refused = 0;
  int others = 0;
  std::vector<std::string> notes;
};

DiveResults dive(const std::string& tag, std::uint64_t seed, Way way = Way::kRound,
                 const std::optional<std::vector<Tag>>& really = std::nullopt) {
  Diagnostics diagnostics;
  const auto mission = parse_mission(SourceText(kFile, mission_text(tag, way)), diagnostics);
  EXPECT_TRUE(mission && diagnostics.error_count() == 0);
  const auto world = planning::load_sdf(mission->map_path, diagnostics);
  const auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  DiveSettings settings;
  settings.seed = seed;
  settings.conditions.current_W.y() = -0.05;  // away from the pipes
  settings.cameras = vehicle::stereo_camera_in("clear_pool")->scaled(0.6);
  settings.cameras->rate_hz = 10.0;
  settings.tags = really;
  settings.faults.push_back({FaultKind::kCameraBlackout, 6.0, 12.0});
  DiveResults results;
  int seconds = 0;
  int after = 0;
  results.result =
      simulate_dive(*mission, *world, *model, settings,
                    [&](const StepInputs& in, const StepOutputs& out,
                        const vehicle::GroundTruth& truth, const auto&) {
                      if (in.vision) {
                        const TagResult result = in.vision->tag.result;
                        if (result == TagResult::kUsed) ++results.used;
                        if (result == TagResult::kRefused) ++results.refused;
                        if (result > TagResult::kUsed && result != TagResult::kRefused)
                          ++results.others;
                      }
                      for (const ActionRecord& action : out.actions)
                        results.notes.push_back(action.text);
                      const Eigen::Vector2d e = (truth.X_WB.p - out.estimate.X_WB.p).head<2>();
                      if (out.status.state != "swim") return;
                      results.horizontal_m = e.norm();
                      results.sigma_m = estimation::horizontal_sigma(out.estimate);
                      if (in.now % 1'000'000 == 0 && to_seconds(in.now) >= 26.0) {
                        results.after_turn_m += e.norm();
                        ++after;
                      }
                      if (in.now % 1'000'000 != 0 || results.used == 0) return;
                      const Eigen::Matrix2d P = out.estimate.covariance.topLeftCorner<2, 2>();
                      results.nees += e.dot(P.inverse() * e);
                      ++seconds;
                    });
  if (seconds > 0) results.nees /= seconds;
  results.after_turn_m /= after;
  return results;
}

bool has_note(const DiveResults& results, const std::string& words) {
  for (const std::string& note : results.notes) {
    if (note.find(words) != std::string::npos) return true;
  }
  return false;
}

void expect_home_without_a_jump(const DiveResults& results) {
  EXPECT_EQ(results.result.outcome, "success") << results.result.cause;
  EXPECT_LE(results.refused, results.used) << "an estimate may be wrong by more than it says";
  EXPECT_EQ(results.others, 0);
  EXPECT_GT(results.result.distance_m, 25.0);
  EXPECT_LT(results.result.largest_step_m, 0.05) << "without a jump";
}

TEST(TagDive, WithoutATagNoneIsUsed) {
  DIVE_SKIP_UNDER_SANITIZERS("a dive is drawn, image by image");
  DIVE_SKIP_LONG_TEST();
  const DiveResults results = dive("", 3);
  expect_home_without_a_jump(results);
  EXPECT_EQ(results.used, 0);
}

TEST(TagDive, ATagWhereItTurnsIsUsedAndDoesNoHarm) {
  DIVE_SKIP_UNDER_SANITIZERS("a dive is drawn, image by image");
  const DiveResults results = dive(kTag, 3);
  expect_home_without_a_jump(results);
  EXPECT_GT(results.used, 2);
  EXPECT_TRUE(has_note(results, "tag 7: corrects the vehicle's position by"));
  // Whether a dive without the tag ends nearer to the truth is chance; tag_fix_test.cpp tests the
  // value of a tag.
  EXPECT_LT(results.after_turn_m, 3.0 * results.sigma_m);
  EXPECT_LT(results.horizontal_m, 3.0 * results.sigma_m);
  EXPECT_LT(results.nees, 6.0);
}

TEST(TagDive, ATypoIsReportedAndDoesNoHarm) {
  DIVE_SKIP_UNDER_SANITIZERS("a dive is drawn, image by image");
  Diagnostics diagnostics;
  const auto right = parse_mission(SourceText(kFile, mission_text(kTag, Way::kRound)), diagnostics);
  const auto world = planning::load_sdf(right->map_path, diagnostics);
  const DiveResults results = dive(kTypo, 3, Way::kToTheTurn, known_tags(*right, *world));
  EXPECT_EQ(results.result.outcome, "success") << results.result.cause;
  EXPECT_EQ(results.used, 0);
  EXPECT_GT(results.refused, 2);
  EXPECT_TRUE(has_note(results, "tag 7 is rejected: it would correct the vehicle's position by"));
  EXPECT_LT(results.horizontal_m, 0.5);
}

}  // namespace
}  // namespace dive::mission
