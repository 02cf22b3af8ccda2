// Dives in a declared current: the vehicle reaches its goals, in the time that the budget states.

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "mission/check/check.h"
#include "mission/simulation/simulated_conditions.h"
#include "planning/world/scene.h"
#include "planning/world/sdf.h"
#include "test/common/sanitizers.h"
#include "test/vehicle/aqua2.h"

namespace dive::mission {
namespace {

const std::string kFerry = "missions/scenarios/missions/ferry";
/// Upright pipes and one that lies across, 11 m from start to goal, passed at 0.5 m.
const std::string kBasin = "test/mission/simulation/basin";

struct Loaded {
  Mission mission;
  planning::World world;
};

// A mission in another current; `current` is the element, empty for still water.
Loaded load(const std::string& name, const std::string& current) {
  Diagnostics diagnostics;
  const std::string path = fmt::format("{}/{}.xml", DIVE_SOURCE_DIR, name);
  auto mission = load_mission(path, diagnostics);
  auto world = planning::load_sdf(mission.value().map_path, diagnostics);
  std::string text = mission->source.content();
  if (const std::size_t old = text.find("<current"); old != std::string::npos) {
    const std::size_t end = text.find("</current>", old);
    text.erase(old, (end == std::string::npos ? text.find("/>", old) + 2 : end + 10) - old);
  }
  text.insert(text.find("<limits"), current);
  mission = parse_mission({path, text}, diagnostics);
  return {std::move(mission.value()), std::move(world.value())};
}

struct Dived {
  DiveResult result;
  std::map<std::string, double> nearest_m;  ///< True horizontal distance to each goal.
  double budget_s = 0.0;
};

Dived dive(const Loaded& loaded, DiveSettings settings) {
  static const vehicle::Model kModel = dive::testing::aqua2();
  const planning::Scene scene(loaded.world);
  const Route route = nominal_route(loaded.mission, scene);
  const auto legs = plan_route(route, loaded.mission, loaded.world, kModel.hull, {}, 1);
  Dived dived;
  dived.budget_s =
      make_budget(route, legs, loaded.mission, loaded.world, kModel, {}, {}).duration_s;
  for (const RouteLeg& leg : route.legs) dived.nearest_m[leg.goal.id] = 1e9;
  dived.result = simulate_dive(
      loaded.mission, loaded.world, kModel, settings,
      [&](const StepInputs&, const StepOutputs&, const vehicle::GroundTruth& truth, const auto&) {
        for (const RouteLeg& leg : route.legs) {
          const double distance = (truth.X_WB.p - leg.goal.position_W).head<2>().norm();
          double& nearest = dived.nearest_m[leg.goal.id];
          nearest = std::min(nearest, distance);
        }
      });
  return dived;
}

// Without errors of speed, compass and declaration, which only fixes could mend: the declared
// current alone.
DiveSettings without_other_errors(const Mission& mission) {
  DiveSettings settings;
  settings.conditions = simulated_conditions(mission);
  settings.conditions.current_sigma = 0.0;
  settings.conditions.speed_scale_sigma = 0.0;
  settings.conditions.heading_bias_sigma_deg = 0.0;
  settings.conditions.heading_variation_deg = 0.0;
  settings.conditions.hull_scatter = 0.0;
  settings.conditions.start_sigma_m = 0.0;
  settings.conditions.map_shift_sigma_m = 0.0;
  settings.conditions.map_turn_sigma_deg = 0.0;
  return settings;
}

// The budget leaves out starts and corners, the same time in every current: that of a dive in still
// water.
double left_out_s(const std::string& name) {
  const Loaded loaded = load(name, "");
  const Dived still = dive(loaded, without_other_errors(loaded.mission));
  return still.result.duration_s - still.budget_s;
}

void expect_as_planned(const Loaded& loaded, const Dived& dived, double left_out,
                       const std::string& where, double allowed = 0.1) {
  EXPECT_EQ(dived.result.outcome, "success") << where << ": " << dived.result.cause;
  EXPECT_TRUE(dived.result.collisions.empty()) << where;
  for (const auto& [goal, nearest_m] : dived.nearest_m) {
    EXPECT_LT(nearest_m, loaded.mission.limits.clearance.value) << where << ", " << goal;
  }
  EXPECT_NEAR(dived.budget_s + left_out, dived.result.duration_s, allowed * dived.budget_s)
      << where;
}

TEST(CurrentDive, InOpenWaterItReachesItsGoalsWhereverTheWaterFlows) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  const double left_out = left_out_s(kFerry);
  for (const int towards_deg : {0, 90, 135, 180, 270}) {
    const Loaded loaded =
        load(kFerry, fmt::format("<current speed=\"0.1\" towards_deg=\"{}\"/>", towards_deg));
    const Dived dived = dive(loaded, without_other_errors(loaded.mission));
    expect_as_planned(loaded, dived, left_out, fmt::format("towards {}", towards_deg));
    EXPECT_NEAR(dived.budget_s, dived.result.duration_s, 0.15 * dived.result.duration_s);
    EXPECT_LT(dived.result.final_error_m, 1.0) << "the current alone would make it 10 m";
  }
}

TEST(CurrentDive, TheSameCurrentUndeclaredCarriesItAway) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  const Loaded loaded = load(kFerry, "");
  DiveSettings settings = without_other_errors(loaded.mission);
  settings.conditions.current_W = {0.0, 0.1, 0.0};
  EXPECT_GT(dive(loaded, settings).nearest_m.at("east"), 2.0) << "else the test above is no test";
}

TEST(CurrentDive, ATideThatTurnsUnderWayIsFollowed) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  const Loaded loaded =
      load(kFerry,
           "<current start=\"10:00\"><sample time=\"10:00\" speed=\"0.15\" towards_deg=\"0\"/>"
           "<sample time=\"10:01\" speed=\"0.15\" towards_deg=\"180\"/>"
           "<sample time=\"10:10\" speed=\"0.1\" towards_deg=\"270\"/></current>");
  expect_as_planned(loaded, dive(loaded, without_other_errors(loaded.mission)), left_out_s(kFerry),
                    "turning tide");
}

// With all errors that the simulator draws, the declared current's own among them.
TEST(CurrentDive, AmongObstaclesFixesMendWhatTheDeclarationLacks) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  const double left_out = left_out_s(kBasin);
  for (const int towards_deg : {0, 270}) {
    const Loaded loaded = load(
        kBasin,
        fmt::format("<current speed=\"0.1\" towards_deg=\"{}\" sigma=\"0.02\"/>", towards_deg));
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      DiveSettings settings;
      settings.conditions = simulated_conditions(loaded.mission);
      settings.seed = seed;
      expect_as_planned(loaded, dive(loaded, settings), left_out,
                        fmt::format("towards {}, seed {}", towards_deg, seed), 0.15);
    }
  }
}

}  // namespace
}  // namespace dive::mission
