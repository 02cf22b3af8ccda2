// One stereo pair of the simulated cameras, 752 x 480 each, all of the water's optics included:
// twenty per second in a simulation that should reach real time.

#include <string>

#include <benchmark/benchmark.h>

#include "bench/shipped_map.h"
#include "vehicle/simulator/cameras/stereo_camera.h"

namespace dive::vehicle {
namespace {

// Pairs along a straight line at 0.4 m/s.
void pair(benchmark::State& state, const std::string& name, const WaterOptics& water,
          const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  StereoCameraOptions options;
  options.water = water;
  if ((water.daylight == 0.0).all()) options.lamps = bow_lamps();
  StereoCamera camera(bench::shipped_map(name), options, 1);
  const Eigen::Quaterniond q = heading_along(to - from);
  const Eigen::Vector3d step = 0.02 * (to - from).normalized();
  std::int64_t count = 0;
  for (auto _ : state) {
    const double k = static_cast<double>(count % 100);
    benchmark::DoNotOptimize(camera.take(count * 50'000, {from + k * step, q}));
    ++count;
  }
}

BENCHMARK_CAPTURE(pair, beside_wreck, "wreck", coastal_sea(), {0, 8, -12}, {-12, 6, -12})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(pair, in_wreck_with_lamps, "wreck", dark_wreck(), {4, 0, -12}, {-4, 0, -12})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(pair, clear_pool, "pool1", clear_pool(), {0.8, -0.5, -2}, {6, -0.5, -2})
    ->Unit(benchmark::kMillisecond);

void build(benchmark::State& state, const std::string& name) {
  const planning::World world = bench::shipped_map(name);
  for (auto _ : state) benchmark::DoNotOptimize(StereoCamera(world, {}, 1));
}
BENCHMARK_CAPTURE(build, wreck, "wreck")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dive::vehicle
