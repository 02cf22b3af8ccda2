// Checks on deck of a mission in an unknown environment.

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/check/check.h"
#include "mission/check/route_plan.h"
#include "planning/certify/certify.h"
#include "planning/world/sdf.h"
#include "test/common/file_content.h"

namespace dive::mission {
namespace {

using dive::testing::content_of;

using ::testing::Contains;
using ::testing::Not;

Mission mission_of(const std::string& path) {
  Diagnostics diagnostics;
  std::optional<Mission> mission = load_mission(DIVE_SOURCE_DIR + path, diagnostics);
  EXPECT_TRUE(mission) << path;
  return std::move(mission.value());
}

planning::World world_of(const Mission& mission) {
  Diagnostics diagnostics;
  return planning::load_sdf(mission.map_path, diagnostics).value();
}

vehicle::Model model() {
  Diagnostics diagnostics;
  return vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics).value();
}

std::vector<std::string> codes(const Diagnostics& diagnostics) {
  std::vector<std::string> codes;
  for (const Diagnostic& one : diagnostics.list()) codes.push_back(one.code);
  return codes;
}

const std::string kMurk = "/missions/scenarios/missions/murk.xml";

TEST(InUnknownWater, TheSimulatedWorldIsCheckedAndNamedAsSuch) {
  const Mission mission = mission_of("/test/mission/accepted/unknown_environment.xml");
  CheckOptions options;
  options.simulate = false;
  Diagnostics diagnostics;
  CheckObserver observer;
  SteadyClock clock;
  const CheckReport report =
      check_mission(mission, world_of(mission), model(), options, diagnostics, observer, clock);
  EXPECT_THAT(codes(diagnostics), ::testing::ElementsAre("CHK-UNKNOWN-ENVIRONMENT"));
  EXPECT_EQ(report.legs.size(), 1U);
}

TEST(InUnknownWater, WithoutASimulatedWorldThereIsNoDive) {
  Mission mission = mission_of("/test/mission/accepted/unknown_environment.xml");
  mission.map_file.value.clear();
  mission.map_path.clear();
  Diagnostics diagnostics;
  CheckObserver observer;
  SteadyClock clock;
  const CheckReport report = check_mission(mission, {}, model(), {}, diagnostics, observer, clock);
  EXPECT_THAT(codes(diagnostics), ::testing::ElementsAre("CHK-UNKNOWN-NO-SIMULATION-MAP"));
  EXPECT_FALSE(report.dive);
  EXPECT_GT(report.budget.duration_s, 0.0) << "that of the straight way";
}

TEST(CertifiedText, IsALowerBoundAtTheCutoffOfTheCertifier) {
  EXPECT_EQ(certified_text(1.264), "1.26 m");
  EXPECT_EQ(certified_text(1.2644, 3), "1.264 m");
  EXPECT_EQ(certified_text(planning::CertifyOptions{}.cutoff), "at least 5.00 m");
}

TEST(InUnknownWater, OnlyThereRangeIsMonitored) {
  NominalDive nominal;
  nominal.result.duration_s = 10.0;
  nominal.result.transitions.push_back({0.0, {"", "out", "", "", ""}});
  Mission mission = mission_of("/test/mission/accepted/unknown_environment.xml");
  const auto kinds = [&] {
    std::vector<FaultKind> all;
    for (const FaultCase& one : draw_fault_cases(mission, nominal, {})) {
      all.push_back(one.faults.at(0).kind);
    }
    return all;
  };
  EXPECT_THAT(kinds(), Contains(FaultKind::kRangeSilent));
  EXPECT_THAT(kinds(), Not(Contains(FaultKind::kDepthWild)));
  mission.unknown.reset();
  EXPECT_THAT(kinds(), Contains(FaultKind::kRangeSilent)) << "map fixes need it";
  mission.allows_fixes = false;
  EXPECT_THAT(kinds(), Not(Contains(FaultKind::kRangeSilent)));
  EXPECT_THAT(kinds(), Contains(FaultKind::kAbort));
  EXPECT_THAT(kinds(), Not(Contains(FaultKind::kCameraBlur)));
  mission.estimator.value = EstimatorName::kVisualInertial;
  EXPECT_THAT(kinds(), Contains(FaultKind::kCameraBlur));
}

// With a sensor that observes only open water.
TEST(InUnknownWater, AVehicleThatLosesItsRangeDataSurfaces) {
  const Mission mission = mission_of(kMurk);
  const auto dived = [&](std::vector<Fault> faults) {
    DiveSettings settings;
    settings.faults = std::move(faults);
    settings.script = [](const DiveHands& hands) {
      hands.inputs.free_ahead = planning::FreeAhead{hands.inputs.now, 6.0};
    };
    return simulate_dive(mission, {}, model(), settings, nullptr);
  };
  EXPECT_EQ(dived({}).outcome, "success");
  const DiveResult blind = dived({{FaultKind::kRangeSilent, 8.0}});
  EXPECT_EQ(blind.outcome, "aborted");
  EXPECT_LT(blind.final_depth_m, 0.3);
  ASSERT_EQ(blind.failsafes.size(), 2U);
  EXPECT_EQ(blind.failsafes[0].rung, "hold");
  EXPECT_EQ(blind.failsafes[1].rung, "abort_and_surface");
  EXPECT_EQ(dived({{FaultKind::kRangeSilent, 8.0, 5.0}}).outcome, "success") << "it goes on";
}

// It is commanded back to where it came from, turns about, and then loses its sensor: it must not
// slide on stern first into unobserved space. (By drag alone it would, by most of a metre.)
TEST(InUnknownWater, AVehicleThatTurnedAboutDoesNotSlideSternFirst) {
  Diagnostics diagnostics;
  std::string text = content_of(DIVE_SOURCE_DIR + kMurk);
  const std::string north = R"(<goto id="north" x="6" y="5")";
  ASSERT_NE(text.find(north), std::string::npos);
  text.replace(text.find(north), north.size(), R"(<goto id="north" x="-6" y="0")");
  const std::optional<Mission> mission =
      parse_mission(SourceText("murk.xml", text), diagnostics, MapFile::kNotNeeded);
  ASSERT_TRUE(mission);
  DiveSettings settings;
  std::optional<Utime> turned;
  settings.script = [&](const DiveHands& hands) {
    const bool is_blind = turned && hands.inputs.now < *turned + 8'000'000;
    hands.inputs.free_ahead = planning::FreeAhead{hands.inputs.now, is_blind ? 0.0 : 6.0};
  };
  double astern_m = 0.0;
  const DiveResult result = simulate_dive(*mission, {}, model(), settings,
                                          [&](const StepInputs& in, const StepOutputs& out,
                                              const vehicle::GroundTruth& truth, const auto&) {
                                            if (out.status.state != "north") return;
                                            if (!turned && std::abs(to_rpy(truth.X_WB.q).z()) > 2.0)
                                              turned = in.now;
                                            astern_m += 0.02 * std::max(-truth.v_WB_B.x(), 0.0);
                                          });
  EXPECT_EQ(result.outcome, "success");
  ASSERT_TRUE(turned);
  EXPECT_LT(astern_m, 0.4);
}

}  // namespace
}  // namespace dive::mission
