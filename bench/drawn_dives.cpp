#include "bench/drawn_dives.h"

#include <algorithm>
#include <ranges>
#include <stdexcept>

#include <fmt/format.h>

#include "common/random.h"
#include "mission/check/route.h"
#include "mission/cli/loading.h"
#include "mission/simulation/simulated_conditions.h"
#include "planning/planner.h"
#include "planning/world/primitives.h"
#include "planning/world/sdf.h"

namespace dive::bench {
namespace {

constexpr double kSamePlace = 0.01;  // m between waypoints; a shorter distance has no direction

/// A diver who comes from the side to a point of the route, stays a while, and leaves on the other
/// side.
vehicle::DiverTrack diver_for(const RoutedSetup& setup, std::uint64_t seed) {
  Random random(seed, 0xd1fe);
  const auto last = static_cast<double>(setup.route.size()) - 2.0;
  const auto at = static_cast<std::size_t>(random.uniform(0.25, 0.75) * last) + 1;
  const Eigen::Vector3d way = setup.route[at].p - setup.route[at - 1].p;
  const Eigen::Vector3d side =
      Eigen::Vector3d(-way.y(), way.x(), 0.0).normalized() * (random.uniform() < 0.5 ? 1.0 : -1.0);
  double before = 0.0;
  for (std::size_t i = 1; i <= at; ++i) before += (setup.route[i].p - setup.route[i - 1].p).norm();
  vehicle::DiverTrack track;
  track.speed = random.uniform(0.2, 0.5);
  track.start_s = std::max(0.0, before / 0.4 - random.uniform(2.0, 15.0));
  track.waypoints = {{setup.route[at].p + 3.0 * side, 0.0},
                     {setup.route[at].p, random.uniform(3.0, 20.0)},
                     {setup.route[at].p - 3.0 * side, 0.0}};
  return track;
}

/// Boxes, balls and upright bars on the route or beside it, not at its stops.
std::vector<planning::Obstacle> unmapped_for(const RoutedSetup& setup, int count,
                                             std::uint64_t seed) {
  constexpr double kFromStops = 1.5;  // m
  Random random(seed, 0x0bce7);
  const auto last = static_cast<double>(setup.route.size()) - 1.0;
  std::vector<planning::Obstacle> objects;
  for (int tries = 0; static_cast<int>(objects.size()) < count && tries < 1000; ++tries) {
    const auto i = static_cast<std::size_t>(random.uniform(0.0, last));
    const Eigen::Vector3d way = setup.route[i + 1].p - setup.route[i].p;
    const Eigen::Vector3d side = Eigen::Vector3d(-way.y(), way.x(), 0.0).normalized();
    const double along = random.uniform();
    const double aside = random.uniform(-0.4, 0.4);
    const double kind = random.uniform();
    const double size = random.uniform(0.15, 0.5);
    const Eigen::Vector3d at = setup.route[i].p + along * way + aside * side;
    if (std::ranges::any_of(setup.stops, [&](const Eigen::Vector3d& stop) {
          return (stop - at).norm() < kFromStops;
        })) {
      continue;
    }
    const planning::Shape shape =
        kind < 0.4   ? planning::Shape(planning::Box{Eigen::Vector3d::Constant(size)})
        : kind < 0.7 ? planning::Shape(planning::Sphere{0.5 * size})
                     : planning::Shape(planning::Cylinder{0.15 * size + 0.03, 2.0});
    objects.push_back(
        {fmt::format("unmapped_{}", objects.size()), shape, {at, Eigen::Quaterniond::Identity()}});
  }
  return objects;
}

/// Within the time of the route at 0.3 m/s.
mission::Fault fault_for(const RoutedSetup& setup, mission::FaultKind kind, std::uint64_t seed) {
  Random random(seed, 0xfa17);
  double length_m = 0.0;
  for (std::size_t i = 1; i < setup.route.size(); ++i) {
    length_m += (setup.route[i].p - setup.route[i - 1].p).norm();
  }
  mission::Fault fault;
  fault.kind = kind;
  fault.at_s = random.uniform(2.0, length_m / 0.3);
  return fault;
}

}  // namespace

RoutedSetup load_routed(const std::string& path, const Draw& draw) {
  RoutedSetup setup{load_setup(path), {}, {}, {}, {}};
  if (!draw.world.empty()) {
    Diagnostics diagnostics;
    setup.other_world = planning::load_sdf(draw.world, diagnostics);
    if (!setup.other_world) throw std::runtime_error(draw.world + " cannot be read");
  }
  const auto conditions =
      mission::parse_conditions(draw.conditions, mission::simulated_conditions(setup.mission));
  if (!conditions) throw std::runtime_error("a condition cannot be set");
  setup.conditions = *conditions;
  const planning::Scene scene(setup.world);
  const mission::Route route = mission::nominal_route(setup.mission, scene);
  SteadyClock clock;
  planning::Planner planner(setup.world, setup.model.hull, {}, clock);
  Pose at = route.start;
  setup.stops.push_back(at.p);
  for (const mission::RouteLeg& leg : route.legs) {
    const planning::PlanRequest request = behaviors::leg_request(route.settings, leg.goal, at);
    const planning::PlanResult plan = planner.plan(request);
    for (const Pose& waypoint : plan.waypoints) {
      const bool is_new =
          setup.route.empty() || (waypoint.p - setup.route.back().p).norm() > kSamePlace;
      if (is_new) setup.route.push_back(waypoint);
    }
    at = request.goal;
    setup.stops.push_back(at.p);
  }
  if (setup.route.size() < 2) throw std::runtime_error(path + ": no leg can be planned");
  return setup;
}
mission::DiveSettings settings_for(const RoutedSetup& setup, const Draw& draw, std::uint64_t seed) {
  mission::DiveSettings settings;
  settings.conditions = setup.conditions;
  settings.world = setup.other_world;
  settings.unmapped = unmapped_for(setup, draw.unmapped, seed);
  settings.seed = seed;
  if (draw.with_diver) settings.diver = diver_for(setup, seed);
  if (draw.fault) settings.faults.push_back(fault_for(setup, *draw.fault, seed));
  return settings;
}

}  // namespace dive::bench
