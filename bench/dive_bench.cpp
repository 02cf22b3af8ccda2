// A whole dive of the Window mission: simulator, sensors, estimator, executive, planner, ground
// truth. `times_real_time` is dive time over processor time of all threads.

#include <ctime>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "common/assert.h"
#include "mission/cli/loading.h"
#include "mission/simulation/simulated_dive.h"

namespace dive::mission {
namespace {

const LoadedMission& window() {
  static const LoadedMission loaded = [] {
    Diagnostics diagnostics;
    auto result = load(std::string(DIVE_SOURCE_DIR) + "/missions/window.xml",
                       planning::Resources::kInFolder, diagnostics);
    DIVE_DEMAND(result.has_value());
    return std::move(*result);
  }();
  return loaded;
}

void window_dive(benchmark::State& state) {
  DiveSettings settings;
  double dived_s = 0.0;
  const std::clock_t begin = std::clock();
  for (auto _ : state) {
    const DiveResult result =
        simulate_dive(window().mission, window().world, window().model, settings, nullptr);
    if (result.outcome != "success") state.SkipWithError("the dive did not succeed");
    dived_s += result.duration_s;
    ++settings.seed;
  }
  const double processor_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  state.counters["times_real_time"] = dived_s / processor_s;
}
BENCHMARK(window_dive)->Unit(benchmark::kMillisecond);

// From the file to a mission ready to run: schema, rules, the map's name; not the map.
void load_a_mission(benchmark::State& state, const char* name) {
  const std::string path = fmt::format("{}/missions/{}.xml", DIVE_SOURCE_DIR, name);
  for (auto _ : state) {
    Diagnostics diagnostics;
    const auto mission = load_mission(path, diagnostics);
    if (!mission) state.SkipWithError("the mission is not accepted");
    benchmark::DoNotOptimize(mission);
  }
}
BENCHMARK_CAPTURE(load_a_mission, window, "window")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(load_a_mission, blocks, "blocks")->Unit(benchmark::kMillisecond);

// One control tick of the executive alone, with constructed inputs, while it holds station and
// waits for the plan of its first leg. No two values of a sensor at rest are the same.
void executive_holding_step(benchmark::State& state) {
  constexpr Utime kTick = 20'000;
  constexpr Utime kLongest = 15'000'000;  // us, before it takes the planner for dead
  std::optional<Executive> executive;
  StepInputs inputs;
  inputs.health = HealthSample{};
  for (auto _ : state) {
    if (!executive || inputs.now >= kLongest) {
      state.PauseTiming();
      executive.emplace(window().mission, window().world, window().model, ExecutiveOptions{});
      inputs.now = 0;
      state.ResumeTiming();
    }
    inputs.now += kTick;
    const double noise = inputs.now % (2 * kTick) == 0 ? 1e-4 : -1e-4;
    inputs.depth = DepthSample{inputs.now, 3.0 + noise};
    inputs.imu = ImuSample{};
    inputs.imu->utime = inputs.health->utime = inputs.now;
    inputs.imu->accel_B = {noise, noise, 9.81 + noise};
    inputs.imu->gyro_B.setConstant(noise);
    inputs.free_ahead.reset();
    if (inputs.now % (10 * kTick) == 0) inputs.free_ahead = planning::FreeAhead{inputs.now, 10.0};
    const StepOutputs& outputs = executive->step(inputs);
    if (outputs.status.state != "gate" || outputs.status.rung != "none") {
      state.SkipWithError("it does not hold station");
      break;
    }
  }
}
BENCHMARK(executive_holding_step)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dive::mission
