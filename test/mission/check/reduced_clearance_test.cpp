// `dive check` on a mission that starts nearer to a wall than its clearance.

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/check/check.h"
#include "vehicle/model.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

constexpr double kClearance = 0.6;  // m, required
constexpr double kAtStart = 0.3;    // m, from hull to wall

vehicle::Model aqua2() {
  Diagnostics diagnostics;
  return vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics).value();
}

// A wall along x, `kAtStart` from a hull that lies level at the origin and heads east.
planning::World wall_beside(const planning::RobotHull& hull) {
  double side = 0.0;
  for (const Eigen::Vector3d& v : hull.hull_vertices()) side = std::min(side, v.y());
  Pose wall;
  wall.p = {0.0, side - kAtStart - 1.0, -5.0};
  return {{{"quay", planning::Box{{40.0, 2.0, 12.0}}, wall}}};
}

// From beside the wall to open water. `limits` and `leg` are attributes.
Diagnostics checked(const std::string& limits, const std::string& leg) {
  const std::string text = fmt::format(
      "<mission xmlns=\"urn:dive:mission:1\" id=\"m\">\n"
      "<vehicle model=\"aqua2\" speed=\"0.4\"/><map file=\"maps/window.sdf\"/>\n"
      "<start x=\"0\" y=\"0\" z=\"5\" z_units=\"DEPTH\" heading_deg=\"90\"/>\n"
      "<limits max_depth=\"15\" min_altitude=\"0\" clearance=\"{}\" mission_timeout=\"900\""
      " battery_reserve=\"0.2\" {}/><states initial=\"out\">\n"
      "<goto id=\"out\" x=\"5\" y=\"6\" z=\"5\" z_units=\"DEPTH\" timeout=\"300\" "
      "on_timeout=\"up\" {}>"
      "<transition event=\"done.state.out\" target=\"up\"/></goto><surface id=\"up\">"
      "<transition event=\"done.state.up\" target=\"end\"/></surface><final id=\"end\"/></states>"
      "</mission>",
      kClearance, limits, leg);
  Diagnostics diagnostics;
  const std::optional<Mission> mission =
      parse_mission(SourceText(DIVE_SOURCE_DIR "/missions/window.xml", text), diagnostics);
  EXPECT_TRUE(mission);
  if (!mission) return diagnostics;
  const vehicle::Model model = aqua2();
  CheckOptions options;
  options.simulate = false;
  CheckObserver observer;
  SteadyClock clock;
  const CheckReport report = check_mission(*mission, wall_beside(model.hull), model, options,
                                           diagnostics, observer, clock);
  EXPECT_EQ(report.legs.size(), 1U);
  if (!report.legs.empty()) {
    EXPECT_EQ(report.legs.front().plan.status, planning::PlanStatus::kReduced);
    EXPECT_NEAR(report.legs.front().plan.clearance_m, kAtStart, 0.02);
  }
  return diagnostics;
}

void expect_refused(const Diagnostics& diagnostics, const std::string& accepted) {
  ASSERT_EQ(diagnostics.error_count(), 1U);
  const auto error = std::ranges::find(diagnostics.list(), Severity::kError, &Diagnostic::severity);
  EXPECT_EQ(error->code, "CHK-PLAN");
  EXPECT_EQ(error->span.line, 5) << "the goal that is left for";
  EXPECT_GT(error->span.column, 0);
  EXPECT_THAT(error->message, HasSubstr("goal 'out' is reduced"));
  EXPECT_THAT(error->message, HasSubstr("less than 0.6 m"));
  EXPECT_THAT(error->message, HasSubstr("m of the path keep 0."));
  EXPECT_THAT(error->message, HasSubstr("nearest to quay"));
  EXPECT_THAT(error->message, HasSubstr("narrowest at ("));
  EXPECT_THAT(error->message, HasSubstr(accepted));
  EXPECT_THAT(error->hint, HasSubstr("reduced_clearance"));
}

TEST(ReducedClearance, IsAnErrorUnlessTheMissionAcceptsIt) {
  expect_refused(checked("", ""), "accepts no reduced clearance");
}

TEST(ReducedClearance, IsAcceptedInLimitsOrOnTheLeg) {
  EXPECT_EQ(checked("reduced_clearance=\"0.25\"", "").error_count(), 0U);
  EXPECT_EQ(checked("", "reduced_clearance=\"0.25\"").error_count(), 0U);
}

TEST(ReducedClearance, OfTheLegComesBeforeThatInLimits) {
  expect_refused(checked("reduced_clearance=\"0.25\"", "reduced_clearance=\"0.4\""),
                 "accepts 0.4 m");
  expect_refused(checked("reduced_clearance=\"0.4\"", ""), "accepts 0.4 m");
  EXPECT_EQ(checked("reduced_clearance=\"0.4\"", "reduced_clearance=\"0.25\"").error_count(), 0U);
}

}  // namespace
}  // namespace dive::mission
