// Plans of the Window mission, certificate included, beside OMPL's RRTConnect (first path,
// simplified) on the same question in the same run.

#include <limits>

#include <benchmark/benchmark.h>

#include "bench/peers.h"
#include "common/assert.h"
#include "planning/planner.h"
#include "planning/world/sdf.h"
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
  static const World world = [] {
    Diagnostics diagnostics;
    auto read = load_sdf(DIVE_SOURCE_DIR "/missions/maps/window.sdf", diagnostics);
    DIVE_DEMAND(read.has_value());
    return *read;
  }();
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

BENCHMARK_CAPTURE(plan, to_gate, kToGate)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(plan, into_room_b, kIntoRoomB)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(peer, into_room_b_RRTConnect, kIntoRoomB)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(5);

}  // namespace
}  // namespace dive::planning
