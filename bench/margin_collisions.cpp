// Does a margin mean what planning/certify/position_margin.h says? Legs by dead reckoning, straight
// past one or two blocks, with a start so uncertain that the least margin is a drawn one between
// 0.5 and 2.5. By the definition of the margin a leg ends in a collision with a probability between
// Phi(-m) of the narrowest passage, halved for the follower's tube, which is subtracted in full,
// and the sum of Phi(-m) over its passages.
//
//     margin_collisions --legs 50 --dives 50 --first 4711

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/run_study.h"
#include "common/parallel.h"
#include "common/random.h"
#include "mission/check/position_margin.h"
#include "mission/simulation/simulated_conditions.h"
#include "mission/simulation/simulated_dive.h"

namespace dive::bench {
namespace {

constexpr double kLeastMargin = 0.5;
constexpr double kLargestMargin = 2.5;
constexpr double kMarginTolerance = 0.05;
constexpr double kClearance = 0.15;  // m, required of the plan: less than any passage has

double phi(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

/// A leg of `length` (m) to the east. The map that it names is replaced by blocks.
mission::Mission straight_leg(double length) {
  const std::string text = fmt::format(R"(<mission xmlns="urn:dive:mission:1" id="straight">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map file="maps/pool3.sdf" fixes="off" mapping_sensor="none"/>
  <start x="0" y="0" z="3" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="8" min_altitude="0" clearance="{}" mission_timeout="600"
          battery_reserve="0.3"/>
  <states initial="swim">
    <goal_sequence id="swim" timeout="300" on_timeout="ascend">
      <goal id="end" x="{}" y="0" z="3" z_units="DEPTH" capture_radius="0.4"/>
      <transition event="done.state.swim plan.failed.swim" target="ascend"/>
    </goal_sequence>
    <surface id="ascend"><transition event="done.state.ascend" target="surfaced"/></surface>
    <final id="surfaced"/>
  </states>
</mission>)",
                                       kClearance, length);
  Diagnostics diagnostics;
  auto mission = mission::parse_mission(SourceText(DIVE_SOURCE_DIR "/missions/straight.xml", text),
                                        diagnostics);
  if (!mission) throw std::runtime_error("the leg's mission cannot be read");
  return std::move(*mission);
}

struct Leg {
  mission::Mission mission;
  planning::World world;
  std::vector<double> margins;  ///< Of the passages.
  int collided = 0;             ///< Dives.

  [[nodiscard]] double least() const { return *std::ranges::min_element(margins); }
  [[nodiscard]] double at_least() const { return 0.5 * phi(-least()); }
  [[nodiscard]] double at_most() const {
    double sum = 0.0;
    for (const double margin : margins) sum += phi(-margin);
    return sum;
  }
};

/// The margin of the passage of each block on the planned path.
std::vector<double> margins(const Leg& leg, const mission::Route& route,
                            const std::vector<mission::PlannedRouteLeg>& planned,
                            const vehicle::Model& model) {
  std::vector<double> margins;
  for (const planning::Obstacle& block : leg.world.obstacles) {
    planning::World alone;
    alone.obstacles.push_back(block);
    std::vector<mission::PlannedRouteLeg> past = planned;
    mission::predict_position_margins(route, past, leg.mission, alone, model);
    margins.push_back(past.front().margin.margin_sigma);
  }
  return margins;
}

/// A leg of this least margin; empty if dead reckoning alone leaves less.
std::optional<Leg> try_leg(const vehicle::Model& model, double wanted, Random& random) {
  const double length = random.uniform(8.0, 20.0);
  Leg leg{straight_leg(length), {}, {}};
  const int blocks = random.uniform() < 0.5 ? 1 : 2;
  double beside = 0.0;
  for (const Eigen::Vector3d& vertex_B : model.hull.hull_vertices()) {
    beside = std::max(beside, vertex_B.y());
  }
  for (int i = 0; i < blocks; ++i) {
    const double side = random.uniform() < 0.5 ? 1.0 : -1.0;
    const double room = random.uniform(0.25, 1.6);
    const Eigen::Vector3d at(length * random.uniform(0.3, 0.9), side * (beside + room + 0.5), -3.0);
    leg.world.obstacles.push_back({fmt::format("block_{}", i),
                                   planning::Box{{0.5, 1.0, 4.0}},
                                   {at, Eigen::Quaterniond::Identity()}});
  }
  const planning::Scene scene(leg.world);
  const mission::Route route = mission::nominal_route(leg.mission, scene);
  const std::vector<mission::PlannedRouteLeg> planned =
      mission::plan_route(route, leg.mission, leg.world, model.hull, {}, 1);
  double least_sigma = 0.0;
  double largest_sigma = 2.0;
  for (int i = 0; i < 20; ++i) {
    leg.mission.priors.start_m = 0.5 * (least_sigma + largest_sigma);
    leg.margins = margins(leg, route, planned, model);
    (leg.least() > wanted ? least_sigma : largest_sigma) = leg.mission.priors.start_m;
  }
  if (std::abs(leg.least() - wanted) > kMarginTolerance) return std::nullopt;
  return leg;
}

Leg draw_leg(const vehicle::Model& model, std::uint64_t seed) {
  Random random(seed, 0x3a561);
  const double wanted = random.uniform(kLeastMargin, kLargestMargin);
  for (;;) {
    if (std::optional<Leg> leg = try_leg(model, wanted, random)) return *std::move(leg);
  }
}

bool collides(const Leg& leg, const vehicle::Model& model, std::uint64_t seed) {
  mission::DiveSettings settings;
  settings.conditions = mission::simulated_conditions(leg.mission);
  settings.seed = seed;
  return !mission::simulate_dive(leg.mission, leg.world, model, settings, nullptr)
              .collisions.empty();
}

void measure(int legs, int dives, std::uint64_t first, int jobs) {
  Diagnostics diagnostics;
  const auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  if (!model) throw std::runtime_error("the vehicle cannot be read");
  std::vector<Leg> drawn(static_cast<std::size_t>(legs), Leg{});
  run_in_parallel(drawn.size(), jobs, [&](std::size_t i) {
    drawn[i] = draw_leg(*model, first + i);
    for (int k = 0; k < dives; ++k) {
      const std::uint64_t seed = first + 1000 * (i + 1) + static_cast<std::uint64_t>(k);
      drawn[i].collided += collides(drawn[i], *model, seed) ? 1 : 0;
    }
  });
  for (double from = kLeastMargin; from < kLargestMargin; from += 0.5) {
    double at_least = 0.0;
    double at_most = 0.0;
    int collided = 0;
    int count = 0;
    for (const Leg& leg : drawn) {
      if (leg.least() < from || leg.least() >= from + 0.5) continue;
      ++count;
      collided += leg.collided;
      at_least += dives * leg.at_least();
      at_most += dives * leg.at_most();
    }
    std::cout << fmt::format(
        "margins of {:.1f} to {:.1f}: {} legs, {} of {} dives collide, {:.1f} to {:.1f} expected\n",
        from, from + 0.5, count, collided, count * dives, at_least, at_most);
  }
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("Collisions on legs of small margins beside the probability that a margin means");
  int legs = 50;
  int dives = 50;
  std::uint64_t first = 1;
  int jobs = 2;
  app.add_option("--legs", legs);
  app.add_option("--dives", dives, "Of each leg");
  app.add_option("--first", first, "First seed");
  app.add_option("--jobs", jobs);
  CLI11_PARSE(app, argc, argv);
  return dive::bench::run_study([&] { dive::bench::measure(legs, dives, first, jobs); });
}
