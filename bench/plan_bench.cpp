// Plans of the Window mission, certificate included, and OMPL's RRTConnect (first path, simplified)
// on the same request in the same run.

#include <cmath>
#include <limits>
#include <memory>

#include <benchmark/benchmark.h>

#include "bench/peers.h"
#include "bench/shipped_map.h"
#include "common/assert.h"
#include "common/random.h"
#include "planning/map_matching/expected_view.h"
#include "planning/planner.h"
#include "vehicle/model.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

struct Leg {
  Vector3d from;
  Vector3d to;
};
constexpr double kClearance = 1.0;
constexpr double kSmallClearance = 0.3;
constexpr double kClutteredClearance = 0.6;
const Leg kToGate{{-4.0, -2.0, -3.0}, {-1.0, -2.0, -4.0}};
const Leg kThroughCluttered{{0.0, 0.2, -3.0}, {39.0, 0.2, -3.0}};
const Leg kIntoRoomB{{-1.0, -2.0, -4.0}, {9.8, -2.0, -4.6}};

const World& window() {
  static const World world = bench::shipped_map("window");
  return world;
}

const RobotHull& hull() {
  static const RobotHull aqua2 = [] {
    Diagnostics diagnostics;
    auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
    DIVE_DEMAND(model.has_value());
    return model->hull;
  }();
  return aqua2;
}

PlanRequest request_for(const Leg& leg, double clearance) {
  PlanRequest request;
  request.start.p = leg.from;
  request.goal.p = leg.to;
  request.limits.attitude = AttitudeMode::kHorizontal;
  request.limits.clearance = clearance;
  return request;
}

// Plans with consecutive seeds.
void plan_in(benchmark::State& state, const World& world, PlanRequest request,
             const PlannerOptions& options = {}) {
  SteadyClock clock;
  Planner planner(world, hull(), options, clock);
  double warm_starts = 0.0;
  double iterations = 0.0;
  double waypoints_solved = 0.0;
  PlannerStatistics times;
  PlanResult result;
  for (auto _ : state) {
    result = planner.plan(request);
    if (result.status != PlanStatus::kSuccess) state.SkipWithError(result.reason.c_str());
    warm_starts += result.warm_starts;
    const PlannerStatistics& cost = planner.statistics();
    iterations += cost.iterations;
    waypoints_solved += static_cast<double>(cost.waypoints_solved);
    times.optimise_ms += cost.optimise_ms;
    times.certify_ms += cost.certify_ms;
    times.warm_start_ms += cost.warm_start_ms;
    ++request.seed;
  }
  const auto runs = static_cast<double>(state.iterations());
  state.counters["warm_starts"] = warm_starts / runs;
  state.counters["iterations"] = iterations / runs;
  state.counters["waypoints_solved"] = waypoints_solved / runs;
  state.counters["optimise_ms"] = times.optimise_ms / runs;
  state.counters["certify_ms"] = times.certify_ms / runs;
  state.counters["warm_start_ms"] = times.warm_start_ms / runs;
  state.counters["waypoints"] = static_cast<double>(result.waypoints.size());
  state.counters["length_m"] = result.length_m;
}

void plan(benchmark::State& state, const Leg& leg, double clearance) {
  plan_in(state, window(), request_for(leg, clearance));
}

// Pipes of 0.05 to 0.2 m radius and 2 to 6 m length, turned at random, in the 16 x 6 x 6 m around a
// lane of 20 m.
World random_pipes(std::uint64_t seed, int count) {
  Random random(seed);
  World world;
  for (int i = 0; i < count; ++i) {
    Obstacle pipe{"pipe", Cylinder{random.uniform(0.05, 0.2), random.uniform(2.0, 6.0)}, Pose{}};
    pipe.X_WO.p = Vector3d(random.uniform(2.0, 18.0), random.uniform(-3.0, 3.0),
                           -10.0 + random.uniform(-3.0, 3.0));
    pipe.X_WO.q = so3_exp(
        Vector3d(random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0)));
    world.obstacles.push_back(pipe);
  }
  return world;
}

void plan_among_pipes(benchmark::State& state) {
  PlanRequest request;
  request.start.p = Vector3d(0.0, 0.0, -10.0);
  request.goal.p = Vector3d(20.0, 0.0, -10.0);
  request.limits.clearance = kSmallClearance;
  plan_in(state, random_pipes(static_cast<std::uint64_t>(state.range(0)), 30), request);
}
BENCHMARK(plan_among_pipes)->DenseRange(1, 8)->Unit(benchmark::kMillisecond);

void peer(benchmark::State& state, const Leg& leg) {
  const PlanRequest request = request_for(leg, kClearance);
  bench::PeerTask task;
  task.start = request.start;
  task.goal = request.goal;
  task.horizontal = true;
  task.clearance = kClearance;
  task.length_target = std::numeric_limits<double>::infinity();
  for (auto _ : state) {
    if (!bench::run_peer("RRTConnect", window(), hull(), task).reached) {
      state.SkipWithError("not solved");
    }
    ++task.seed;
  }
}

// Boxes of 1 x 0.5 x 0.3 m in random attitudes, one to 60 m^3 of water around a lane of `length`
// metres.
World boulders_along(double length, int count) {
  Random random(3);
  World world;
  const double half = std::sqrt(60.0 * count / length) / 2.0;
  for (int i = 0; i < count; ++i) {
    Obstacle boulder{"boulder", Box{Vector3d(1.0, 0.5, 0.3)}, Pose{}};
    boulder.X_WO.p = Vector3d(random.uniform(0.0, length), random.uniform(-half, half),
                              -60.0 + random.uniform(-half, half));
    boulder.X_WO.q = so3_exp(
        Vector3d(random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0)));
    world.obstacles.push_back(boulder);
  }
  return world;
}

void plan_along(benchmark::State& state, double length, int count) {
  PlanRequest request;
  request.start.p = Vector3d(-3.0, 0.0, -60.0);
  request.goal.p = Vector3d(length + 3.0, 0.0, -60.0);
  request.limits.clearance = kSmallClearance;
  request.limits.min_z = -200.0;
  plan_in(state, boulders_along(length, count), request);
}

// Longer lanes with the same number of boulders per metre: up to 400 waypoints, then 1,000 m.
void plan_over_waypoints(benchmark::State& state) {
  const double length = 1.5 * static_cast<double>(state.range(0));
  plan_along(state, length, static_cast<int>(length));
}
BENCHMARK(plan_over_waypoints)
    ->Arg(10)
    ->Arg(25)
    ->Arg(50)
    ->Arg(100)
    ->Arg(200)
    ->Arg(400)
    ->Arg(667)
    ->Unit(benchmark::kMillisecond);

// The same lane of 40 m in increasingly large fields of boulders.
void plan_over_obstacles(benchmark::State& state) {
  plan_along(state, 40.0, static_cast<int>(state.range(0)));
}
BENCHMARK(plan_over_obstacles)
    ->Arg(20)
    ->Arg(60)
    ->Arg(200)
    ->Arg(600)
    ->Arg(2000)
    ->Unit(benchmark::kMillisecond);

// From end to end of Cluttered, the path preferred along which scans tell the position or not.
void plan_through_cluttered(benchmark::State& state, bool prefers_information) {
  static const World world = bench::shipped_map("cluttered");
  PlannerOptions options;
  if (prefers_information) options.preferred_view = std::make_shared<ExpectedView>(world);
  PlanRequest request = request_for(kThroughCluttered, kClutteredClearance);
  request.limits.attitude = AttitudeMode::kFree;
  plan_in(state, world, request, options);
}
BENCHMARK_CAPTURE(plan_through_cluttered, shortest, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(plan_through_cluttered, informative, true)->Unit(benchmark::kMillisecond);

BENCHMARK_CAPTURE(plan, to_gate, kToGate, kClearance)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(plan, into_room_b, kIntoRoomB, kClearance)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(plan, into_room_b_closely, kIntoRoomB, kSmallClearance)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(peer, into_room_b_RRTConnect, kIntoRoomB)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(5);

}  // namespace
}  // namespace dive::planning
