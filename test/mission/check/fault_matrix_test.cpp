// The dives with faults of `dive check --faults`: instants, order and ends.

#include "mission/check/fault_matrix.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/document/mission.h"
#include "vehicle/model.h"

namespace dive::mission {
namespace {

constexpr double kTick = 0.02;

vehicle::Model model() {
  Diagnostics diagnostics;
  return vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics).value();
}

// Deep in open water: at least ten seconds outwards, and up.
Mission mission() {
  constexpr const char* kText = R"(<mission xmlns="urn:dive:mission:1" id="out">
    <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
    <map file="none.sdf"/>
    <start x="0" y="0" z="4" z_units="DEPTH" heading_deg="90"/>
    <limits max_depth="8" min_altitude="0.3" clearance="0.6" mission_timeout="120"
            battery_reserve="0.2"/>
    <failsafes><imu_lost rung="hold" after="0.5" clear="2"/></failsafes>
    <states initial="out">
      <goto id="out" x="8" y="0" z="4" z_units="DEPTH" timeout="100" on_timeout="up">
        <transition event="done.state.out" target="up"/>
      </goto>
      <surface id="up"><transition event="done.state.up" target="surfaced"/></surface>
      <final id="surfaced"/>
    </states>
  </mission>)";
  Diagnostics diagnostics;
  return parse_mission(SourceText("out.xml", kText), diagnostics, MapFile::kNotNeeded).value();
}

// In "out" from 0 to 20 s, under an overhead from 5 to 12 s; in "up" from 20 to 50 s.
NominalDive nominal() {
  NominalDive nominal;
  nominal.result.duration_s = 50.0;
  nominal.result.transitions.push_back({0.0, {"", "out", "", "", ""}});
  nominal.result.transitions.push_back({20.0, {"out", "up", "", "", ""}});
  for (int tick = 0; tick <= 2500; ++tick) {
    nominal.under_overhead.push_back(tick >= 250 && tick < 600);
  }
  return nominal;
}

using FaultAndState = std::pair<FaultKind, std::string>;

FaultAndState what(const FaultCase& one) { return {one.faults.at(0).kind, one.state}; }

std::map<FaultAndState, std::vector<double>> instants_of(const std::vector<FaultCase>& cases) {
  std::map<FaultAndState, std::vector<double>> instants;
  for (const FaultCase& one : cases) {
    if (one.faults.size() == 1) instants[what(one)].push_back(one.faults.at(0).at_s);
  }
  for (auto& [faults, times] : instants) std::ranges::sort(times);
  return instants;
}

TEST(FaultDraw, HasInstantsSoonAfterEntryShortlyBeforeExitAndBetween) {
  const auto instants = instants_of(draw_fault_cases(mission(), nominal(), {7, 5, 0}));
  EXPECT_EQ(instants.size(), 30U);  // 15 faults in 2 states
  for (const auto& [faults, times] : instants) {
    const double begin = faults.second == "out" ? 0.0 : 20.0;
    const double end = faults.second == "out" ? 20.0 : 50.0;
    ASSERT_EQ(times.size(), 5U);
    EXPECT_GT(times.front(), begin);
    EXPECT_LE(times.front(), begin + 1.1);
    EXPECT_GE(times.back(), end - 1.1);
    EXPECT_LT(times.back(), end);
    for (const double t : times) EXPECT_NEAR(t / kTick, std::round(t / kTick), 1e-6);
  }
}

TEST(FaultDraw, DrawsOneInstantFromTheWholeStay) {
  std::set<double> fifths;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    for (const auto& [faults, times] :
         instants_of(draw_fault_cases(mission(), nominal(), {seed, 1, 0}))) {
      if (faults.second == "out") fifths.insert(std::floor(times.at(0) / 4.0));
    }
  }
  EXPECT_EQ(fifths.size(), 5U);
}

TEST(FaultDraw, StaysWithinAStateOfAFewTicks) {
  NominalDive brief = nominal();
  brief.result.transitions[1].t_s = 0.06;
  for (int instants = 1; instants < 6; ++instants) {
    for (const auto& [faults, times] :
         instants_of(draw_fault_cases(mission(), brief, {1, instants, 0}))) {
      if (faults.second != "out") continue;
      for (const double t : times) EXPECT_TRUE(t == 0.02 || t == 0.04) << t;
    }
  }
}

TEST(FaultDraw, IsRepeatedBySeedAndDiffersByFaultAndSeed) {
  const auto instants = instants_of(draw_fault_cases(mission(), nominal(), {7, 3, 0}));
  EXPECT_EQ(instants, instants_of(draw_fault_cases(mission(), nominal(), {7, 3, 1})))
      << "pairs change nothing";
  EXPECT_NE(instants, instants_of(draw_fault_cases(mission(), nominal(), {8, 3, 0})));
  EXPECT_NE(instants.at({FaultKind::kLeak, "out"}), instants.at({FaultKind::kBattery, "out"}));
}

TEST(FaultDraw, DivesEachFaultInEachStateBeforeAnyTwiceAndUnderTheOverheadFirst) {
  const std::vector<FaultCase> cases = draw_fault_cases(mission(), nominal(), {7, 3, 1});
  std::size_t at = 0;
  for (int round = 0; round < 3; ++round) {
    std::set<FaultAndState> seen;
    bool is_open = false;
    for (int i = 0; i < 30; ++i, ++at) {
      EXPECT_EQ(cases.at(at).faults.size(), 1U);
      EXPECT_TRUE(seen.insert(what(cases.at(at))).second);
      EXPECT_FALSE(is_open && cases.at(at).under_overhead);
      is_open = !cases.at(at).under_overhead;
    }
  }
  EXPECT_TRUE(cases.front().under_overhead);
  EXPECT_EQ(cases.size() - at, 2U * 15U * 14U / 2U);
  for (; at < cases.size(); ++at) EXPECT_EQ(cases[at].faults.size(), 2U);
}

TEST(FaultDraw, TimesAreReadAgainAsTheyArePrinted) {
  for (const FaultCase& one : draw_fault_cases(mission(), nominal(), {3, 40, 0})) {
    const double at_s = one.faults.at(0).at_s;
    EXPECT_EQ(std::strtod(fmt::format("{:.2f}", at_s).c_str(), nullptr), at_s);
  }
}

// A hold without attitude, under an overhead with a wall to the east.
planning::World hall() {
  planning::World world;
  world.obstacles.push_back({"roof", planning::Box{{60, 60, 0.5}}, Pose{{0, 0, -1.5}}});
  world.obstacles.push_back({"wall", planning::Box{{1, 60, 20}}, Pose{{14, 0, -10}}});
  return world;
}

FaultResult result_of(const DiveSettings& settings) {
  FaultCase fault{"out", {{FaultKind::kImuSilent, 6.0}}};
  return dive_with_faults({fault}, mission(), hall(), model(), settings, 1,
                          [](std::size_t, const FaultResult&) {})
      .at(0);
}

// A minute in one place proves nothing: the water begins to move after that.
TEST(FaultDives, RunToTheirEndAndFindTheLateCollision) {
  DiveSettings settings;
  settings.script = [](const DiveHands& hands) {
    if (hands.inputs.now == from_seconds(80.0)) hands.simulator.set_current({0.2, 0, 0});
  };
  const FaultResult result = result_of(settings);
  ASSERT_FALSE(result.dive.collisions.empty());
  EXPECT_GT(result.dive.collisions.front().t_s, 80.0);
  EXPECT_FALSE(result.is_safe());
  EXPECT_EQ(result.dive.outcome, "failure");
  EXPECT_THAT(describe(result), ::testing::HasSubstr("imu_silent at 6.00 s in 'out'"));
}

TEST(FaultDives, AreHeldOnlyToTheEndOfTheLongestDive) {
  const FaultResult result = result_of({});
  EXPECT_TRUE(result.held) << describe(result);
  EXPECT_TRUE(result.is_safe());
  EXPECT_NEAR(result.dive.duration_s, longest_dive_s(mission()), 0.05);
  EXPECT_GT(result.dive.rest_s, 30.0);
}

// Ten dives with a fault at the start that end after 10 s, and ten with one at 290 s: when half of
// the dives have ended, a thirtieth of the work is done, not half of it.
TEST(FaultProgress, CountsSimulatedSecondsAndNotDives) {
  std::vector<FaultCase> cases(20, {"in", {{FaultKind::kLeak, 0.0}}});
  for (std::size_t i = 10; i < 20; ++i) cases[i].faults.front().at_s = 290.0;
  FaultProgress progress(cases);
  EXPECT_EQ(progress.share(), 0.0);
  const auto dive = [&](std::size_t i) {
    FaultResult result;
    result.fault = cases[i];
    result.dive.duration_s = cases[i].faults.front().at_s + 10.0;
    progress.add(result);
  };
  for (std::size_t i = 0; i < 10; ++i) dive(i);
  EXPECT_NEAR(progress.share(), 100.0 / 3100.0, 1e-9);
  for (std::size_t i = 10; i < 20; ++i) dive(i);
  EXPECT_EQ(progress.share(), 1.0);
}

TEST(FaultDives, AreTheSameOnAnyNumberOfThreads) {
  const std::vector<FaultCase> cases = {{"out", {{FaultKind::kLeak, 6.0}}},
                                        {"out", {{FaultKind::kDepthSilent, 9.0}}},
                                        {"out", {{FaultKind::kAbort, 2.5}}}};
  const auto dived = [&](int threads) {
    std::vector<double> figures;
    for (const FaultResult& one : dive_with_faults(cases, mission(), {}, model(), {}, threads,
                                                   [](std::size_t, const FaultResult&) {})) {
      figures.insert(figures.end(), {one.dive.duration_s, one.dive.distance_m, one.dive.energy_wh});
    }
    return figures;
  };
  EXPECT_EQ(dived(1), dived(3));
}

}  // namespace
}  // namespace dive::mission
