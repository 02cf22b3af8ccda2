// Cost of the log per tick: written and passed to the system, and read back.

#include <filesystem>
#include <optional>
#include <string>

#include <benchmark/benchmark.h>

#include "mission/record/log.h"

namespace dive::mission {
namespace {

struct Tick {
  StepInputs inputs;
  StepOutputs outputs;
  TruthRecord truth;
};

Tick usual_tick(Utime now) {
  Tick tick;
  tick.inputs.now = now;
  tick.inputs.imu.emplace().utime = now;
  tick.inputs.depth.emplace().utime = now;
  tick.outputs.estimate.utime = now;
  tick.outputs.status.state = "through_the_window";
  tick.outputs.status.goal = "far_room";
  tick.outputs.status.rung = "none";
  tick.truth.utime = now;
  return tick;
}

std::string log_path() {
  return (std::filesystem::temp_directory_path() / "dive_log_bench.lcm").string();
}

void BM_WriteTick(benchmark::State& state) {
  auto log = LogWriter::create(log_path(), {});
  Utime now = 0;
  for (auto _ : state) {
    const Tick tick = usual_tick(now += 20'000);
    if (!log->write(tick.inputs, tick.outputs, tick.truth)) state.SkipWithError("disk full");
  }
  log->close();
  state.counters["bytes_per_tick"] = static_cast<double>(std::filesystem::file_size(log_path())) /
                                     static_cast<double>(state.iterations());
  std::filesystem::remove(log_path());
}
BENCHMARK(BM_WriteTick);

void BM_ReadTick(benchmark::State& state) {
  constexpr int kTicks = 5000;
  auto log = LogWriter::create(log_path(), {});
  for (int i = 0; i < kTicks; ++i) {
    const Tick tick = usual_tick(20'000 * i);
    log->write(tick.inputs, tick.outputs, tick.truth);
  }
  log->close();
  for (auto _ : state) {
    auto reader = LogReader::open(log_path());
    while (auto tick = reader->next()) benchmark::DoNotOptimize(tick);
  }
  state.SetItemsProcessed(state.iterations() * kTicks);
  std::filesystem::remove(log_path());
}
BENCHMARK(BM_ReadTick)->Unit(benchmark::kMillisecond);

void BM_CompareTick(benchmark::State& state) {
  const Tick a = usual_tick(1);
  const Tick b = usual_tick(1);
  for (auto _ : state) benchmark::DoNotOptimize(first_difference(a.outputs, b.outputs));
}
BENCHMARK(BM_CompareTick);

}  // namespace
}  // namespace dive::mission
