// Legs, times and budgets in a declared current, against closed forms.

#include "mission/check/current_check.h"

#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/check/budget.h"
#include "mission/check/check.h"
#include "planning/world/scene.h"
#include "test/mission/check/brick.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

using testing::brick;

planning::World seabed(bool has_roof) {
  planning::World world;
  Pose bottom;
  bottom.p = {0.0, 0.0, -20.0};
  world.obstacles.push_back({"seabed", planning::HalfSpace{Eigen::Vector3d::UnitZ()}, bottom});
  if (has_roof) {
    world.obstacles.push_back({"roof", planning::Box{{20.0, 20.0, 0.5}}, Pose{{20.0, 0.0, -1.0}}});
  }
  return world;
}

struct Checked {
  Route route;
  std::vector<PlannedRouteLeg> legs;
  std::vector<std::optional<LeastProgress>> progress;
  RouteTimes times;
  ExitPathProof exit_path;
  Budget budget;
  Diagnostics diagnostics;
};

// 20 m east and 20 m north, 5 m deep, 30 s of rest at the first goal, at 0.4 m/s.
Checked check(const std::string& current, double dwell_s = 0.0, bool has_roof = false,
              const MotionModel& motion = {}) {
  const std::string text = fmt::format(
      "<mission xmlns=\"urn:dive:mission:1\" id=\"m\">\n"
      "<vehicle model=\"aqua2\" speed=\"0.4\" attitude=\"horizontal\"/>\n"
      "<map file=\"maps/none.sdf\"/>\n"
      "<start x=\"0\" y=\"0\" z=\"5\" z_units=\"DEPTH\" heading_deg=\"90\"/>\n"
      "{}\n"
      "<limits max_depth=\"19\" min_altitude=\"2\" clearance=\"0.6\" mission_timeout=\"900\""
      " battery_reserve=\"0.2\"/>\n<states initial=\"a\"><goal_sequence id=\"a\" timeout=\"300\" "
      "on_timeout=\"up\">\n<goal id=\"east\" x=\"20\" y=\"0\" z=\"5\" z_units=\"DEPTH\" "
      "dwell=\"{}\"/>\n"
      "<goal id=\"north\" x=\"20\" y=\"20\" z=\"5\" z_units=\"DEPTH\"/>\n"
      "<transition event=\"done.state.a\" target=\"up\"/></goal_sequence><surface id=\"up\">"
      "<transition event=\"done.state.up\" target=\"end\"/></surface><final id=\"end\"/></states>"
      "</mission>",
      current, dwell_s);
  Checked checked;
  Diagnostics reading;
  const auto mission = parse_mission({"m.xml", text}, reading, MapFile::kNotNeeded);
  EXPECT_TRUE(mission) << (reading.list().empty() ? "" : render(reading.list()[0], false));
  const planning::World world = seabed(has_roof);
  const planning::Scene scene(world);
  const planning::RobotHull hull = brick();
  checked.route = nominal_route(*mission, scene);
  checked.legs = plan_route(checked.route, *mission, world, hull, {}, 1);
  EXPECT_EQ(checked.legs.size(), 2U);
  checked.times = route_times(checked.route, checked.legs, *mission);
  checked.progress = least_progress(checked.route, checked.legs, *mission, world, hull.radius());
  check_current(checked.route, checked.legs, checked.progress, *mission, checked.diagnostics);
  checked.exit_path = prove_exit_path(checked.route, checked.legs, *mission, world, hull, {});
  vehicle::Model model;
  model.hull = hull;
  model.motion = motion;
  checked.budget =
      make_budget(checked.route, checked.legs, *mission, world, model, checked.exit_path, {});
  return checked;
}

// The plans of open water are straight except for a few centimetres.
constexpr double kStraight = 0.02;   // relative
constexpr double kAscentRate = 0.2;  // m/s
constexpr double kTurn_s = 3.0;      // s to turn by 90 degrees

TEST(CurrentCheck, InStillWaterNothingIsReported) {
  const Checked checked = check("");
  EXPECT_TRUE(checked.diagnostics.list().empty());
  EXPECT_NEAR(checked.times.legs[0].arrives_s, 50.0, 50.0 * kStraight);
  EXPECT_NEAR(checked.budget.duration_s, 100.0 + kTurn_s + 5.0 / kAscentRate, 3.0);
}

// By heave alone, which is slow; nose down it is as fast as ahead.
TEST(CurrentCheck, ALevelDescentTakesTheTimeOfTheHeave) {
  const auto time_s = [](double pitch, const Eigen::Vector3d& end) {
    Mission mission;
    mission.speed.value = 0.4;
    const Eigen::Quaterniond q = from_rpy(0.0, pitch, 0.0);
    Route route;
    route.legs.resize(1);
    std::vector<PlannedRouteLeg> legs(1);
    legs[0].plan.waypoints = {Pose{{0, 0, -2}, q}, Pose{end, q}};
    return route_times(route, legs, mission).legs[0].arrives_s;
  };
  EXPECT_NEAR(time_s(0.0, {0, 0, -7}), 5.0 / 0.14, 5.0);
  EXPECT_NEAR(time_s(0.0, {5, 0, -7}), 5.0 / 0.14, 5.0);
  EXPECT_NEAR(time_s(M_PI / 4, {5, 0, -7}), std::sqrt(50.0) / 0.4, 0.1);
  EXPECT_NEAR(time_s(0.0, {5, 0, -2}), 5.0 / 0.4, 0.1);
}

TEST(CurrentCheck, TheBudgetUsesTheSpeedAtFullEffort) {
  MotionModel slow;
  slow.full_speed = 0.5;
  EXPECT_GT(check("", 0.0, false, slow).budget.energy_wh, 1.2 * check("").budget.energy_wh);
}

TEST(CurrentCheck, TheBudgetUsesTheSpeedOverGround) {
  const Checked still = check("");
  const Checked checked = check("<current speed=\"0.1\" towards_deg=\"90\"/>");
  const double along_s = 20.0 / 0.5;
  const double across_s = 20.0 / std::sqrt(0.4 * 0.4 - 0.1 * 0.1);
  const std::vector<LegTimes>& legs = checked.times.legs;
  EXPECT_NEAR(legs[0].arrives_s, along_s, along_s * kStraight);
  EXPECT_NEAR(legs[1].arrives_s - legs[1].begins_s - kTurn_s, across_s, across_s * kStraight);
  const double saved_s = still.budget.duration_s - checked.budget.duration_s;
  EXPECT_NEAR(saved_s, 100.0 - along_s - across_s, 1.0);
  const double saved_wh = still.budget.energy_wh - checked.budget.energy_wh;
  EXPECT_NEAR(3600.0 * saved_wh / saved_s, 25.0 + 7.0 + 5.6, 0.1)
      << "W at rest, to steer, and to swim at half speed: that through the water";
  EXPECT_TRUE(checked.diagnostics.list().empty());
}

TEST(CurrentCheck, ExitPathsAreSwumInTheCurrentToo) {
  const Checked still = check("", 0.0, true);
  const Checked checked = check("<current speed=\"0.1\" towards_deg=\"90\"/>", 0.0, true);
  const double up_s = 5.0 / kAscentRate;
  EXPECT_GT(checked.exit_path.longest_s - up_s, 1.1 * (still.exit_path.longest_s - up_s));
  EXPECT_GT(checked.budget.budget_used_under_overhead, 0.0);
}

TEST(CurrentCheck, TheTableOfTheTimeOfEachLegCounts) {
  // Still for the first 40 s, then 0.2 m/s against the second leg.
  const Checked checked = check(
      "<current start=\"10:00\" sigma=\"0\"><sample time=\"09:00\" speed=\"0\" "
      "towards_deg=\"180\"/>"
      "<sample time=\"10:01\" speed=\"0\" towards_deg=\"180\"/>"
      "<sample time=\"10:02\" speed=\"0.2\" towards_deg=\"180\"/>"
      "<sample time=\"11:00\" speed=\"0.2\" towards_deg=\"180\"/></current>",
      70.0);
  const std::vector<LegTimes>& legs = checked.times.legs;
  EXPECT_NEAR(legs[0].arrives_s, 50.0, 1.0);
  EXPECT_NEAR(legs[1].begins_s, legs[0].arrives_s + 70.0, 1e-9);
  EXPECT_NEAR(legs[1].arrives_s - legs[1].begins_s - kTurn_s, 20.0 / 0.2, 2.0);
  ASSERT_TRUE(checked.progress[1]);
  EXPECT_NEAR(checked.progress[1]->share, 0.5, 0.02);
}

TEST(CurrentCheck, ACurrentThatIsTooStrongForALegIsRefused) {
  const Checked checked = check("<current speed=\"0.28\" towards_deg=\"180\" sigma=\"0.04\"/>");
  ASSERT_EQ(checked.diagnostics.error_count(), 2U) << "one for each leg";
  const Diagnostic& across = checked.diagnostics.list()[0];
  EXPECT_EQ(across.span.line, 8);
  EXPECT_THAT(across.message, HasSubstr("a crab angle of 53 degrees, more than 29"));
  const Diagnostic& against = checked.diagnostics.list()[1];
  EXPECT_EQ(against.code, "CHK-CURRENT");
  EXPECT_EQ(against.span.line, 9);
  EXPECT_GT(against.span.column, 0);
  EXPECT_THAT(against.source_line, HasSubstr("\"north\""));
  EXPECT_THAT(against.message, HasSubstr("0.28 m/s towards 180 degrees, with a sigma of 0.04 m/s"));
  EXPECT_THAT(against.message, HasSubstr("m/s over ground are left of 0.4 m/s"));
  EXPECT_NEAR(checked.progress[1]->over_ground, std::sqrt(0.16 - 0.04 * 0.04) - 0.32, 0.01);
  EXPECT_THAT(against.message, HasSubstr("less than 25 %"));
  EXPECT_THAT(against.hint, HasSubstr("speed"));
}

TEST(CurrentCheck, ACurrentThatSlowsALegMuchIsWarnedOf) {
  const Checked checked = check("<current speed=\"0.24\" towards_deg=\"225\" sigma=\"0\"/>");
  EXPECT_TRUE(checked.diagnostics.ok()) << checked.diagnostics.list().at(0).message;
  ASSERT_EQ(checked.diagnostics.warning_count(), 2U) << "one for each leg";
  EXPECT_EQ(checked.diagnostics.list()[0].code, "CHK-CURRENT-MARGIN");
  EXPECT_THAT(checked.diagnostics.list()[0].message, HasSubstr("'east'"));
}

TEST(CurrentCheck, UnderAnOverheadTheWayBackCounts) {
  const std::string current = "<current speed=\"0.32\" towards_deg=\"90\"/>";
  const auto is_refused = [](const Checked& checked) {
    return checked.progress[0]->is_way_back && !checked.diagnostics.ok();
  };
  EXPECT_FALSE(is_refused(check(current, 0.0, false))) << "in open water an abort ascends";
  const Checked under = check(current, 0.0, true);
  EXPECT_TRUE(is_refused(under));
  EXPECT_THAT(under.diagnostics.list()[0].message, HasSubstr("on the way back from 'east'"));
}

TEST(CurrentCheck, ATableThatEndsBeforeTheRouteIsRefused) {
  const auto with = [](const char* start, const char* first, const char* last) {
    return check(
        fmt::format("<current start=\"{}\"><sample time=\"{}\" speed=\"0\" towards_deg=\"0\"/>"
                    "<sample time=\"{}\" speed=\"0\" towards_deg=\"0\"/></current>",
                    start, first, last));
  };
  EXPECT_TRUE(with("10:00", "10:00", "10:03").diagnostics.ok()) << "133 s";
  for (const Checked& short_one :
       {with("10:00", "10:00", "10:02"), with("10:00", "10:01", "11:00")}) {
    ASSERT_EQ(short_one.diagnostics.error_count(), 1U);
    EXPECT_EQ(short_one.diagnostics.list()[0].code, "CHK-CURRENT-TABLE");
    EXPECT_EQ(short_one.diagnostics.list()[0].span.line, 5);
    EXPECT_THAT(short_one.diagnostics.list()[0].hint, HasSubstr("rows to the table"));
  }
}

TEST(CurrentCheck, ARestInWhichTheCurrentCarriesItAwayIsWarnedOf) {
  const std::string current = "<current speed=\"0.05\" towards_deg=\"90\"/>";
  EXPECT_EQ(check(current, 10.0).diagnostics.warning_count(), 0U) << "0.5 m";
  const Checked checked = check(current, 30.0);
  ASSERT_EQ(checked.diagnostics.warning_count(), 1U);
  EXPECT_EQ(checked.diagnostics.list()[0].code, "CHK-CURRENT-DRIFT");
  EXPECT_THAT(checked.diagnostics.list()[0].message, HasSubstr("1.5 m"));
}

}  // namespace
}  // namespace dive::mission
