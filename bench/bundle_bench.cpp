// Cost of a verified bundle at the start of a dive: reading it from the disk with its hash and
// code, and proving its plans again.

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "mission/bundle/bundle.h"
#include "mission/bundle/bundled_dive.h"
#include "mission/bundle/plan_proof.h"

namespace dive::mission {
namespace {

constexpr link::Key kKey = {1, 2, 3};

/// The signed bundle of a shipped mission, as the command makes it.
std::string bundle_of(const std::string& mission) {
  namespace fs = std::filesystem;
  const std::string base = (fs::temp_directory_path() / "dive_bundle_bench").string();
  fs::remove(base + ".key");
  if (!link::write_key(base + ".key", kKey)) throw std::runtime_error("no key can be written");
  const std::string command = fmt::format(
      "'{}' check --static '{}/missions/{}.xml' --bundle {}.bundle --key {}.key --force "
      "> {}.txt",
      DIVE_COMMAND, DIVE_SOURCE_DIR, mission, base, base, base);
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command);
  return base + ".bundle";
}

OpenedBundle opened(const std::string& path) {
  auto bundle = read_bundle(path, kKey);
  if (!bundle) throw std::runtime_error(bundle.error());
  return std::move(*bundle);
}

void BM_Read(benchmark::State& state, const std::string& mission) {
  const std::string path = bundle_of(mission);
  for (auto _ : state) benchmark::DoNotOptimize(opened(path));
  state.counters["bytes"] = static_cast<double>(std::filesystem::file_size(path));
}

void BM_Load(benchmark::State& state, const std::string& mission) {
  const OpenedBundle bundle = opened(bundle_of(mission));
  for (auto _ : state) benchmark::DoNotOptimize(bundled_dive(bundle.bundle));
}

void BM_Prove(benchmark::State& state, const std::string& mission) {
  const OpenedBundle bundle = opened(bundle_of(mission));
  const auto dive = bundled_dive(bundle.bundle);
  if (!dive) throw std::runtime_error(dive.error());
  for (auto _ : state) {
    const auto proof =
        prove_plans(bundle.bundle.legs, dive->mission, dive->world, dive->model.hull);
    if (!proof) throw std::runtime_error(proof.error());
  }
  state.counters["legs"] = static_cast<double>(bundle.bundle.legs.size());
}

BENCHMARK_CAPTURE(BM_Read, window, "window")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Load, window, "window")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Prove, window, "window")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Prove, wreck, "wreck")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Prove, maze, "maze")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Prove, blocks, "blocks")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dive::mission
