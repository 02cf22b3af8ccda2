// Plans of the Window mission, certificate included, beside OMPL's RRTConnect (first path,
// simplified) on the same question in the same run.

#include <cmath>
#include <limits>

#include <benchmark/benchmark.h>

#include "bench/peers.h"
#include "bench/shipped_map.h"
#include "common/assert.h"
#include "common/random.h"
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
const Leg kToGate{{-4.0, -2.0, -3.0}, {-1.0, -2.0, -4.0}};
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

PlanRequest request_for(const Leg& leg) {
  PlanRequest request;
  request.start.p = leg.from;
  request.goal.p = leg.to;
  request.attitude = AttitudeMode::kHorizontal;
  request.clearance = kClearance;
  return request;
}

void plan(benchmark::State& state, const Leg& leg) {
  SteadyClock clock;
  Planner planner(window(), hull(), {}, clock);
  PlanRequest request = request_for(leg);
  double warm_starts = 0.0;
  for (auto _ : state) {
    const PlanResult result = planner.plan(request);
    if (result.status != PlanStatus::kSuccess) state.SkipWithError(result.reason.c_str());
    warm_starts += result.warm_starts;
    ++request.seed;
  }
  state.counters["warm_starts"] = warm_starts / static_cast<double>(state.iterations());
}

void peer(benchmark::State& state, const Leg& leg) {
  const PlanRequest request = request_for(leg);
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

// Boxes of 1 x 0.5 x 0.3 m, anyhow turned, one to 60 m^3 of water around a lane of `length` metres.
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
  SteadyClock clock;
  const World world = boulders_along(length, count);
  Planner planner(world, hull(), {}, clock);
  PlanRequest request;
  request.start.p = Vector3d(-3.0, 0.0, -60.0);
  request.goal.p = Vector3d(length + 3.0, 0.0, -60.0);
  request.clearance = 0.3;
  request.min_z = -200.0;
  std::size_t waypoints = 0;
  for (auto _ : state) {
    const PlanResult result = planner.plan(request);
    if (result.status != PlanStatus::kSuccess) state.SkipWithError(result.reason.c_str());
    waypoints = result.waypoints.size();
  }
  state.counters["waypoints"] = static_cast<double>(waypoints);
}

// Longer lanes among as many boulders to the metre: 10 to 400 waypoints.
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
    ->Unit(benchmark::kMillisecond);

// The same lane of 40 m in ever larger fields of boulders.
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

BENCHMARK_CAPTURE(plan, to_gate, kToGate)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(plan, into_room_b, kIntoRoomB)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(peer, into_room_b_RRTConnect, kIntoRoomB)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(5);

}  // namespace
}  // namespace dive::planning
