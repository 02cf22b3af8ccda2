// Speed of the simulation relative to real time: the vehicle alone, and with estimator, follower
// and autopilot in the loop. The counter `times_real_time` is the result.

#include <cstdlib>
#include <vector>

#include <benchmark/benchmark.h>

#include "estimation/primitive.h"
#include "vehicle/autopilot.h"
#include "vehicle/follower.h"
#include "vehicle/model.h"
#include "vehicle/simulator/simulator.h"

namespace dive {
namespace {

vehicle::Model aqua2() {
  Diagnostics diagnostics;
  std::optional<vehicle::Model> model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  if (!model) std::abort();
  return *model;
}

const Pose kStart{{0.0, 0.0, -5.0}, Eigen::Quaterniond::Identity()};

void report(benchmark::State& state) {
  state.counters["times_real_time"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * vehicle::Simulator::kTick,
                         benchmark::Counter::kIsRate);
}

void simulator_step(benchmark::State& state) {
  vehicle::Simulator sim(aqua2(), kStart, {}, 1);
  const vehicle::PseudoRates rates{0.25, -0.05, 0.0, 0.0, 0.02};
  for (auto _ : state) benchmark::DoNotOptimize(sim.step(rates));
  report(state);
}
BENCHMARK(simulator_step);

void control_loop_tick(benchmark::State& state) {
  vehicle::Simulator sim(aqua2(), kStart, {}, 1);
  estimation::PrimitiveEstimator estimator({}, kStart.p, 0.0);
  vehicle::Autopilot autopilot{vehicle::AutopilotOptions{}};
  vehicle::Follower follower{vehicle::FollowerOptions{}};
  std::vector<Pose> square;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {9.0, 0.0}, {9.0, 9.0}, {0.0, 9.0}, {0.0, 0.0}}) {
    square.push_back({{x, y, -5.0}, Eigen::Quaterniond::Identity()});
  }
  follower.set_path(square, kStart.p);
  vehicle::PseudoRates rates;
  vehicle::Command command;
  for (auto _ : state) {
    const vehicle::SensorSamples samples = sim.step(rates);
    if (samples.imu) estimator.add(*samples.imu);
    if (samples.depth) estimator.add(*samples.depth);
    estimator.set_commanded_speed(command.v);
    const estimation::StateEstimate& estimate = estimator.update(sim.truth().utime);
    if (!estimate.valid) continue;
    if (follower.status().finished) follower.set_path(square, kStart.p);
    command = follower.step(estimate.X_WB, estimate.v_WB_B);
    rates = autopilot.step(command, samples.imu->q_WB, samples.imu->gyro_B, samples.depth->depth_m,
                           vehicle::Simulator::kTick);
  }
  report(state);
}
BENCHMARK(control_loop_tick);

}  // namespace
}  // namespace dive
