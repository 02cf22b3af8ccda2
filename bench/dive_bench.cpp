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

// One control tick of the executive alone, with constructed inputs, while it holds station.
void executive_holding_step(benchmark::State& state) {
  Executive executive(window().mission, window().world, window().model, {});
  StepInputs inputs;
  inputs.depth = DepthSample{0, 3.0};
  inputs.imu = ImuSample{};
  inputs.health = HealthSample{};
  for (auto _ : state) {
    inputs.now += 20'000;
    if (inputs.now > 50'000'000) {  // before the first leg's timeout
      state.PauseTiming();
      executive = Executive(window().mission, window().world, window().model, {});
      inputs.now = 20'000;
      state.ResumeTiming();
    }
    inputs.depth->utime = inputs.imu->utime = inputs.health->utime = inputs.now;
    benchmark::DoNotOptimize(&executive.step(inputs));
  }
}
BENCHMARK(executive_holding_step)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dive::mission
