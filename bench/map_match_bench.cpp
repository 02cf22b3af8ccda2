// One map fix of a range scan, on primitives and on a mesh of 31,000 triangles: at most 5 ms.

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <benchmark/benchmark.h>

#include "bench/shipped_map.h"
#include "planning/map_matching/map_matcher.h"
#include "vehicle/simulator/sensors/range_camera.h"

namespace dive::bench {
namespace {

// A ship's hull: an ellipsoid of 20 x 4 x 4 m with a bumpy skin.
planning::World mesh_world() {
  constexpr int kRings = 125;
  constexpr int kSides = 124;
  planning::Surface surface{"hull", {}};
  for (int i = 0; i <= kRings; ++i) {
    for (int k = 0; k < kSides; ++k) {
      const double a = std::numbers::pi * i / kRings;
      const double b = 2.0 * std::numbers::pi * k / kSides;
      const double r = 1.0 + 0.02 * std::sin(9.0 * a) * std::cos(7.0 * b);
      surface.mesh.vertices.emplace_back(10.0 * std::cos(a), 2.0 * r * std::sin(a) * std::cos(b),
                                         -5.0 + 2.0 * r * std::sin(a) * std::sin(b));
    }
  }
  const auto at = [](int i, int k) {
    return static_cast<std::uint32_t>(i * kSides + (k % kSides));
  };
  for (int i = 0; i < kRings; ++i) {
    for (int k = 0; k < kSides; ++k) {
      surface.mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      surface.mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  planning::World world;
  world.surfaces.push_back(std::move(surface));
  return world;
}

void match(benchmark::State& state, const planning::World& world, const Eigen::Vector3d& from,
           const Eigen::Vector3d& to, double sigma_m) {
  vehicle::RangeCamera camera(world, {}, 1);
  const planning::MapMatcher matcher(world);
  const Eigen::Quaterniond q = heading_along(to - from);
  std::vector<std::pair<RangeScan, planning::PosePrior>> scans;
  for (int i = 0; i < 20; ++i) {
    const double t = i / 19.0;
    planning::PosePrior prior;
    prior.X_WB = Pose{(1.0 - t) * from + t * to, q};
    prior.covariance.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, 4e-4;
    RangeScan scan = camera.take(i * 100'000, prior.X_WB);
    prior.X_WB.p += Eigen::Vector3d(0.03, -0.04, 0.0);
    prior.odometry_O = prior.X_WB.p.head<2>();
    scans.emplace_back(std::move(scan), prior);
  }
  std::size_t next = 0;
  std::int64_t used = 0;
  planning::PlaceSearch search;
  for (auto _ : state) {
    const std::size_t index = next++ % scans.size();
    if (index == 0) search = {};
    const auto& [scan, prior] = scans[index];
    used += matcher.place(scan, prior, search).fix.used;
  }
  state.counters["points_used"] =
      static_cast<double>(used) / static_cast<double>(state.iterations());
}

void match_shipped(benchmark::State& state, const std::string& name, const Eigen::Vector3d& from,
                   const Eigen::Vector3d& to, double sigma_m) {
  match(state, shipped_map(name), from, to, sigma_m);
}
void match_mesh(benchmark::State& state, double sigma_m) {
  match(state, mesh_world(), {-8, 4.5, -4}, {8, 4.5, -4}, sigma_m);
}

BENCHMARK_CAPTURE(match_shipped, cluttered, "cluttered", {0, 0.2, -3}, {30, 0.2, -3}, 0.05)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_shipped, cluttered_searching, "cluttered", {0, 0.2, -3}, {30, 0.2, -3}, 0.3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_shipped, maze_searching, "maze", {-1.9, 2, -2.5}, {-1.9, 6, -2.5}, 0.3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_shipped, in_wreck, "wreck", {4, 0, -12}, {-4, 0, -12}, 0.05)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_mesh, triangles_31000, 0.05)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_mesh, triangles_31000_searching, 0.3)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dive::bench
