// The state orbit: its stations by property, and the shipped mission dived and evaluated by ground
// truth.

#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "mission/check/check.h"
#include "mission/check/route.h"
#include "mission/document/state_index.h"
#include "mission/simulation/simulated_dive.h"
#include "planning/world/sdf.h"
#include "test/common/file_content.h"

namespace dive::mission {
namespace {

using Eigen::Vector2d;

const std::string kFile = DIVE_SOURCE_DIR "/missions/orbit.xml";

// The shipped mission with other attributes of its orbit.
std::optional<Mission> with_orbit(const std::string& attributes) {
  std::string text = dive::testing::content_of(kFile);
  const std::size_t begin = text.find("<orbit id=\"boiler\"") + 18;
  text.replace(begin, text.find('>', begin) - begin, " " + attributes);
  Diagnostics diagnostics;
  auto mission = parse_mission(SourceText(kFile, text), diagnostics);
  for (const Diagnostic& diagnostic : diagnostics.list())
    ADD_FAILURE() << render(diagnostic, false);
  return mission;
}

double turned(const Vector2d& from, const Vector2d& to) {
  return std::atan2(from.x() * to.y() - from.y() * to.x(), from.dot(to));
}

TEST(OrbitState, HasItsStationsOnTheCircleInTheDirectionWritten) {
  EXPECT_TRUE(rc::check([] {
    const Vector2d centre(*rc::gen::inRange(-50, 50), *rc::gen::inRange(-50, 50));
    const double radius = *rc::gen::inRange(20, 90) / 10.0;
    const int count = *rc::gen::inRange(4, 20);
    const int first = *rc::gen::inRange(0, 360);
    const bool is_clockwise = *rc::gen::arbitrary<bool>();
    const bool has_arc = *rc::gen::arbitrary<bool>();
    const int arc = *rc::gen::inRange(1, 90 * (count - 1));
    const auto mission = with_orbit(
        fmt::format("x=\"{}\" y=\"{}\" z=\"5\" z_units=\"DEPTH\" radius=\"{}\" stations=\"{}\" "
                    "first_bearing_deg=\"{}\" direction=\"{}\" {} timeout=\"400\" "
                    "on_timeout=\"ascend\"",
                    centre.x(), centre.y(), radius, count, first, is_clockwise ? "cw" : "ccw",
                    has_arc ? fmt::format("arc_deg=\"{}\"", arc) : ""));
    RC_ASSERT(mission.has_value());
    const std::vector<const Goal*> goals = goals_of(mission->states[0]);
    RC_ASSERT(static_cast<int>(goals.size()) == count);
    const double spacing = (has_arc ? 1.0 * arc / (count - 1) : 360.0 / count) * M_PI / 180.0;
    std::optional<Vector2d> last;
    for (const Goal* goal : goals) {
      const Eigen::Vector3d p_W = goal->position.in_world(0.0);
      const Vector2d out = p_W.head<2>() - centre;
      RC_ASSERT(std::abs(out.norm() - radius) < 1e-9);
      RC_ASSERT(p_W.z() == -5.0);
      RC_ASSERT(!goal->heading_deg);  // the path may arrive at any heading
      const double yaw = heading_to_yaw(goal->dwell_heading_deg.value());
      RC_ASSERT((Vector2d(std::cos(yaw), std::sin(yaw)) + out.normalized()).norm() < 1e-9);
      if (last) RC_ASSERT(std::abs(turned(*last, out) + (is_clockwise ? 1 : -1) * spacing) < 1e-9);
      last = out;
    }
    // Compass: 0 is north, 90 is east.
    const Vector2d north_east(std::sin(first * M_PI / 180.0), std::cos(first * M_PI / 180.0));
    const Vector2d begin = goals[0]->position.in_world(0.0).head<2>() - centre;
    RC_ASSERT((begin / radius - north_east).norm() < 1e-9);
  }));
}

// Ground truth for the time in which the vehicle swam to a station or was at it.
struct AtStation {
  double faced_s = 0.0;     ///< Longest time in a row with the bow within 5 degrees of the point.
  double now_s = 0.0;       ///< The present one.
  Vector2d out_W = {0, 0};  ///< From the point to the vehicle, in the last tick of the longest.
};

struct Dived {
  DiveResult result;
  std::vector<std::string> order;
  std::map<std::string, AtStation> stations;
};

Dived dive(const Mission& mission, std::uint64_t seed, const Vector2d& centre) {
  Diagnostics diagnostics;
  const auto world = planning::load_sdf(mission.map_path, diagnostics);
  const auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  DiveSettings settings;
  settings.seed = seed;
  Dived dived;
  const auto observe = [&](const StepInputs&, const StepOutputs& outputs,
                           const vehicle::GroundTruth& truth, const auto&) {
    if (outputs.status.state != "boiler" || outputs.status.goal.empty()) return;
    if (dived.order.empty() || dived.order.back() != outputs.status.goal) {
      dived.order.push_back(outputs.status.goal);
    }
    AtStation& station = dived.stations[outputs.status.goal];
    const Vector2d out = truth.X_WB.p.head<2>() - centre;
    const double yaw = to_rpy(truth.X_WB.q).z();
    const double off = wrap_angle(std::atan2(-out.y(), -out.x()) - yaw);
    const bool is_at_rest = truth.v_WB_B.norm() < 0.1;
    station.now_s = is_at_rest && std::abs(off) <= 5.0 * M_PI / 180.0 ? station.now_s + 0.02 : 0.0;
    if (station.now_s <= station.faced_s) return;
    station.faced_s = station.now_s;
    station.out_W = out;
  };
  dived.result = simulate_dive(mission, *world, *model, settings, observe);
  return dived;
}

void expect_an_orbit(const Dived& dived, bool is_clockwise) {
  ASSERT_EQ(dived.result.outcome, "success") << dived.result.cause;
  EXPECT_TRUE(dived.result.collisions.empty());
  ASSERT_EQ(dived.order.size(), 8U);
  double total = 0.0;
  for (int i = 1; i <= 8; ++i) {
    const std::string id = fmt::format("boiler-{}", i);
    EXPECT_EQ(dived.order[static_cast<std::size_t>(i - 1)], id);
    const AtStation& station = dived.stations.at(id);
    EXPECT_GE(station.faced_s, 6.0 - 1e-6) << id << ": the dwell";
    EXPECT_NEAR(station.out_W.norm(), 3.4, 0.5) << id;
    if (i > 1)
      total += turned(dived.stations.at(fmt::format("boiler-{}", i - 1)).out_W, station.out_W);
  }
  EXPECT_NEAR(total, (is_clockwise ? -1.0 : 1.0) * 7.0 * M_PI / 4.0, 0.3);
}

TEST(OrbitDive, FacesThePointAtEveryStationClockwise) {
  Diagnostics diagnostics;
  const auto mission = load_mission(kFile, diagnostics);
  ASSERT_TRUE(mission);
  expect_an_orbit(dive(*mission, 1, {4.0, 0.0}), true);
}

TEST(OrbitDive, GoesRoundInTheOtherDirection) {
  const auto mission = with_orbit(
      "x=\"4\" y=\"0\" z=\"6.5\" z_units=\"DEPTH\" radius=\"3.4\" stations=\"8\" "
      "first_bearing_deg=\"270\" direction=\"ccw\" dwell=\"6\" timeout=\"400\" "
      "on_timeout=\"ascend\"");
  ASSERT_TRUE(mission);
  expect_an_orbit(dive(*mission, 2, {4.0, 0.0}), false);
}

// Distances, dwells, turns and ascent: the plan and the dive agree.
TEST(OrbitDive, TakesTheTimeOfItsBudget) {
  Diagnostics diagnostics;
  const auto mission = load_mission(kFile, diagnostics);
  const auto world = planning::load_sdf(mission->map_path, diagnostics);
  const auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  CheckOptions options;
  CheckObserver observer;
  SteadyClock clock;
  const CheckReport report =
      check_mission(*mission, *world, *model, options, diagnostics, observer, clock);
  ASSERT_TRUE(diagnostics.ok());
  ASSERT_TRUE(report.dive);
  EXPECT_EQ(report.legs.size(), 8U);
  EXPECT_NEAR(report.dive->duration_s / report.budget.duration_s, 1.0, 0.15);
}

}  // namespace
}  // namespace dive::mission
