// Dives among obstacles with errors that dead reckoning cannot see: the scans of the range camera
// and the map have to mend them.

#include <algorithm>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/simulation/simulated_dive.h"
#include "planning/world/sdf.h"
#include "test/common/sanitizers.h"
#include "test/vehicle/aqua2.h"
#include "vehicle/simulator/drawn_world.h"

namespace dive::mission {
namespace {

struct Loaded {
  Mission mission;
  planning::World world;
};

/// A pool of 14 x 5 x 3 m with three pipes across it, passed at 0.5 m: short enough for absence to
/// be trusted, and narrow enough for a block to close the way.
const std::string kThreePipes = "test/mission/simulation/three_pipes";

Loaded load(const std::string& file, bool fixes = true) {
  Diagnostics diagnostics;
  auto mission = load_mission(fmt::format("{}/{}.xml", DIVE_SOURCE_DIR, file), diagnostics);
  auto world = planning::load_sdf(mission->map_path, diagnostics);
  mission->allows_fixes = fixes;
  return {*std::move(mission), *std::move(world)};
}

struct Outcome {
  DiveResult result;
  double last_error_m = 0.0;  ///< Relative to the map, at the last fix.
  double last_sigma_m = 0.0;
  int fixes = 0;
};

Outcome dive(const Loaded& loaded, const DiveSettings& settings) {
  static const vehicle::Model kModel = dive::testing::aqua2();
  Outcome outcome;
  outcome.result =
      simulate_dive(loaded.mission, loaded.world, kModel, settings,
                    [&](const StepInputs& inputs, const StepOutputs& outputs,
                        const vehicle::GroundTruth& truth, const auto&) {
                      if (!inputs.map_fix || inputs.map_fix->problem != MapFixProblem::kNone)
                        return;
                      ++outcome.fixes;
                      const Eigen::Vector3d off = outputs.estimate.X_WB.p - truth.X_WB.p;
                      outcome.last_error_m = off.head<2>().norm();
                      outcome.last_sigma_m = estimation::horizontal_sigma(outputs.estimate);
                    });
  return outcome;
}

DiveSettings with_current(std::uint64_t seed) {
  DiveSettings settings;
  settings.seed = seed;
  settings.conditions.current_W = {0.03, 0.04, 0.0};
  settings.conditions.speed_scale_sigma = 0.03;
  settings.conditions.heading_bias_sigma_deg = 2.0;
  return settings;
}

TEST(MapFixDive, InACurrentItStaysClearOfWhatItsDeadReckoningHits) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  const Loaded fixed = load("missions/cluttered");
  const Loaded blind = load("missions/cluttered", false);
  int blind_collisions = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Outcome outcome = dive(fixed, with_current(seed));
    EXPECT_EQ(outcome.result.outcome, "success") << seed << ": " << outcome.result.cause;
    EXPECT_TRUE(outcome.result.collisions.empty()) << seed;
    EXPECT_GT(outcome.fixes, 100);
    blind_collisions += dive(blind, with_current(seed)).result.collisions.empty() ? 0 : 1;
  }
  EXPECT_GE(blind_collisions, 3) << "the test is no test if dead reckoning passes it";
}

TEST(MapFixDive, AMapThatIsShiftedAndTurnedIsFollowed) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  const Loaded loaded = load("missions/pool3");
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    DiveSettings settings;
    settings.seed = seed;
    settings.conditions.map_shift_sigma_m = 0.2;
    settings.conditions.map_turn_sigma_deg = 1.0;
    settings.conditions.start_sigma_m = 0.1;
    const Outcome outcome = dive(loaded, settings);
    EXPECT_TRUE(outcome.result.collisions.empty()) << seed;
    EXPECT_LT(outcome.last_error_m, std::max(0.1, 3.0 * outcome.last_sigma_m)) << seed;
  }
}

// A block in the middle of the only leg, of which the map knows nothing.
TEST(MapFixDive, AnObjectThatTheMapLacksIsObservedAndAvoided) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  Loaded loaded = load(kThreePipes);
  DiveSettings settings;
  settings.unmapped.push_back({"block",
                               planning::Box{{0.3, 0.6, 0.6}},
                               {{6.0, 0.0, -1.5}, Eigen::Quaterniond::Identity()}});
  for (settings.seed = 1; settings.seed <= 4; ++settings.seed) {
    const DiveResult result = dive(loaded, settings).result;
    EXPECT_EQ(result.outcome, "success") << settings.seed << ": " << result.cause;
    EXPECT_GT(result.observed_map.pieces(), 0u);
  }
  loaded.mission.mapping_sensor = {MappingSensor::kNone, {}};
  settings.seed = 1;
  const DiveResult blind = dive(loaded, settings).result;
  EXPECT_TRUE(std::ranges::any_of(blind.transitions, [](const TimedTransition& transition) {
    return transition.record.event == "plan.failed.swim";
  })) << "the block is on the way";
}

// Nothing maps it, so that all plans lead through it.
TEST(MapFixDive, StopsBeforeWhatNeitherMapNorMapperHas) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  Loaded loaded = load(kThreePipes);
  loaded.mission.mapping_sensor = {MappingSensor::kNone, {}};
  DiveSettings settings;
  settings.unmapped.push_back({"block",
                               planning::Box{{0.3, 0.6, 0.6}},
                               {{6.0, 0.0, -1.5}, Eigen::Quaterniond::Identity()}});
  for (settings.seed = 1; settings.seed <= 4; ++settings.seed) {
    const DiveResult result = dive(loaded, settings).result;
    EXPECT_TRUE(result.collisions.empty()) << settings.seed << ": " << result.cause;
  }
}

// The second pipe, which crosses the pool, is not there.
TEST(MapFixDive, AMappedPipeThatIsNotThereLeavesTheMapOnlyIfAbsenceIsTrusted) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  static const vehicle::Model kModel = dive::testing::aqua2();
  Loaded loaded = load(kThreePipes);
  planning::World truth = loaded.world;
  const auto is_second = [](const planning::Obstacle& one) {
    return one.name.find("second") != std::string::npos;
  };
  const auto second = std::ranges::find_if(truth.obstacles, is_second) - truth.obstacles.begin();
  ASSERT_EQ(std::erase_if(truth.obstacles, is_second), 1u);
  for (const bool trusts : {true, false}) {
    loaded.mission.trusts_absence = trusts;
    int gone = 0;  // a dive may pass too few places from which scans see enough of it
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      DiveSettings settings;
      settings.seed = seed;
      settings.world = truth;
      const DiveResult result = simulate_dive(loaded.mission, loaded.world, kModel, settings, {});
      EXPECT_EQ(result.outcome, "success") << seed << ": " << result.cause;
      EXPECT_TRUE(result.collisions.empty()) << seed;
      for (std::size_t i = 0; i < loaded.world.obstacles.size(); ++i) {
        const int obstacle = static_cast<int>(i);
        if (!result.observed_map.absent().contains(obstacle)) continue;
        ++gone;
        EXPECT_EQ(obstacle, static_cast<int>(second)) << loaded.world.obstacles[i].name;
      }
    }
    EXPECT_GE(gone, trusts ? 2 : 0);
    EXPECT_LE(gone, trusts ? 3 : 0);
  }
}

TEST(MapFixDive, EqualSettingsGiveEqualFixes) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  const Loaded loaded = load("missions/pool3");
  const Outcome a = dive(loaded, with_current(9));
  const Outcome b = dive(loaded, with_current(9));
  EXPECT_EQ(a.fixes, b.fixes);
  EXPECT_EQ(a.last_error_m, b.last_error_m);
  EXPECT_EQ(a.result.duration_s, b.result.duration_s);
}

TEST(MapFixDive, WithoutScansItTurnsBackUnlessTheMissionSaysOtherwise) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  Loaded loaded = load("missions/pool3");
  DiveSettings settings;
  settings.faults = {{FaultKind::kRangeSilent, 0.0}};
  const Outcome turned = dive(loaded, settings);
  EXPECT_EQ(turned.fixes, 0);
  EXPECT_EQ(turned.result.outcome, "aborted") << turned.result.cause;
  EXPECT_TRUE(turned.result.collisions.empty());
  loaded.mission.failsafes.policy(behaviors::FailsafeKind::kRangeLost).rung =
      behaviors::Rung::kWarn;
  EXPECT_EQ(dive(loaded, settings).result.outcome, "success") << "by dead reckoning";
}

TEST(DrawnWorld, MovesTheMapAsAWholeAndItsObjectsByThemselves) {
  const planning::World map = load("missions/pool3").world;
  vehicle::Conditions conditions;
  conditions.object_shift_sigma_m = 0.0;
  const auto moved = [&](const planning::World& world, std::size_t i) {
    return Eigen::Vector3d(world.obstacles[i].X_WO.p - map.obstacles[i].X_WO.p);
  };
  EXPECT_EQ(moved(vehicle::drawn_world(map, conditions, 3), 1), Eigen::Vector3d::Zero());
  conditions.map_shift_sigma_m = 0.3;
  const planning::World shifted = vehicle::drawn_world(map, conditions, 3);
  const Eigen::Vector3d shift = vehicle::drawn_map_motion(conditions, 3).p;
  EXPECT_GT(shift.norm(), 0.0);
  EXPECT_EQ(shift.z(), 0.0);
  for (std::size_t i = 0; i < map.obstacles.size(); ++i) {
    EXPECT_LT((moved(shifted, i) - shift).norm(), 1e-12);
  }
  EXPECT_GT((moved(vehicle::drawn_world(map, conditions, 4), 0) - shift).norm(), 0.01);
  conditions.map_shift_sigma_m = 0.0;
  conditions.object_shift_sigma_m = 0.1;
  const planning::World apart = vehicle::drawn_world(map, conditions, 3);
  double spread = 0.0;
  for (std::size_t i = 1; i < map.obstacles.size(); ++i) {
    spread = std::max(spread, (moved(apart, i) - moved(apart, 0)).norm());
  }
  EXPECT_GT(spread, 0.02);
}

}  // namespace
}  // namespace dive::mission
