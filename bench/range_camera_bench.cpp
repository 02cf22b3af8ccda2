// One scan of the simulated range camera, noise and marine snow included: ten per second in a
// simulation that must run much faster than real time.

#include <cmath>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/shipped_map.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/sensors/range_camera.h"

namespace dive::vehicle {
namespace {

// Scans along a straight line; optionally with a diver, who swims two metres ahead.
void scan(benchmark::State& state, const std::string& name, const Eigen::Vector3d& from,
          const Eigen::Vector3d& to, bool with_diver) {
  RangeCamera camera(bench::shipped_map(name), {}, 1);
  const Eigen::Quaterniond q = heading_along(to - from);
  std::int64_t count = 0;
  std::int64_t near = 0;
  for (auto _ : state) {
    const double t = static_cast<double>(count % 100) / 99.0;
    const Pose X_WB{(1.0 - t) * from + t * to, q};
    std::optional<Pose> X_WD;
    if (with_diver) X_WD = X_WB * Pose{{2.0, 0.0, -0.5}, Eigen::Quaterniond::Identity()};
    const RangeScan measured = camera.take(count * 100'000, X_WB, X_WD);
    for (const Eigen::Vector3f& p : measured.points_B) near += p.norm() < measured.reach ? 1 : 0;
    ++count;
  }
  state.counters["surfaces_of_7500"] = static_cast<double>(near) / static_cast<double>(count);
}

BENCHMARK_CAPTURE(scan, beside_wreck, "wreck", {0, 8, -12}, {-12, 6, -10}, false)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(scan, in_wreck, "wreck", {4, 0, -12}, {-4, 0, -12}, false)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(scan, cluttered, "cluttered", {0, 0.2, -3}, {30, 0.2, -3}, false)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(scan, cluttered_diver, "cluttered", {0, 0.2, -3}, {30, 0.2, -3}, true)
    ->Unit(benchmark::kMillisecond);

void build(benchmark::State& state, const std::string& name) {
  const planning::World world = bench::shipped_map(name);
  for (auto _ : state) benchmark::DoNotOptimize(RangeCamera(world, {}, 1));
}
BENCHMARK_CAPTURE(build, wreck, "wreck")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dive::vehicle
