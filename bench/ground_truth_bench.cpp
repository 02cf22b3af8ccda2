// The cost of ground truth in a simulation at 50 Hz that must reach 200 times real time and more,
// where a tick may take 100 us in all.

#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/shipped_map.h"
#include "vehicle/model.h"
#include "vehicle/simulator/ground_truth/ground_truth.h"

namespace dive::vehicle {
namespace {

planning::World window() { return bench::shipped_map("window"); }

planning::RobotHull aqua2_hull() {
  Diagnostics diagnostics;
  return parse_urdf(aqua2_urdf(), diagnostics).value().hull;
}

// Every tick of a dive through the window and back at 0.4 m/s, with the yaw and roll caused by the
// flippers.
std::vector<Pose> window_dive() {
  const std::vector<Eigen::Vector3d> corners{{-4, -2, -3},     {-1, -2, -4},     {3, 0, -4.5},
                                             {5.2, 2.1, -4.6}, {7.2, 2.1, -4.6}, {9.8, -2, -4.6},
                                             {7.2, 2.1, -4.6}, {5.2, 2.1, -4.6}, {3, 0, -4.5},
                                             {-1, -2, -4},     {-3, -2, -4},     {-3, -2, -0.3}};
  constexpr double kStep = 0.4 * 0.02;
  std::vector<Pose> poses;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Eigen::Vector3d leg = corners[i] - corners[i - 1];
    const double yaw = std::atan2(leg.y(), leg.x());
    for (double s = 0.0; s < leg.norm(); s += kStep) {
      const double t = static_cast<double>(poses.size()) * 0.02;
      poses.push_back({corners[i - 1] + s * leg.normalized(),
                       from_rpy(0.03 * std::sin(5.0 * t), 0.02 * std::sin(3.0 * t),
                                yaw + 0.05 * std::sin(1.3 * t))});
    }
  }
  return poses;
}

// Time per tick is the inverse of the items per second.
void ObserveWindowDive(benchmark::State& state) {
  const planning::World world = window();
  const planning::RobotHull hull = aqua2_hull();
  const std::vector<Pose> poses = window_dive();
  double least = 0.0;
  for (auto _ : state) {
    state.PauseTiming();
    ClearanceMeter meter(world, hull);
    state.ResumeTiming();
    for (const Pose& pose : poses) meter.observe(pose);
    least = meter.min_clearance_m();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(poses.size()));
  state.counters["min_clearance_m"] = least;
  state.counters["ticks"] = static_cast<double>(poses.size());
}
BENCHMARK(ObserveWindowDive)->Unit(benchmark::kMillisecond);

// One exact measurement, nothing skipped, averaged over the dive.
void MeasureExactly(benchmark::State& state) {
  const ClearanceMeter meter(window(), aqua2_hull());
  const std::vector<Pose> poses = window_dive();
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(meter.clearance(poses[next]));
    next = (next + 37) % poses.size();
  }
}
BENCHMARK(MeasureExactly)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dive::vehicle
