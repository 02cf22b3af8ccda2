// Reading point clouds and converting them to worlds: points on a wavy seabed, such as a sonar
// mosaic.

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include "planning/cloud/cloud_file.h"
#include "planning/mapping/cloud_world.h"

namespace {

std::vector<Eigen::Vector3f> sea_bed(std::int64_t count, double step = 0.05) {
  std::vector<Eigen::Vector3f> points;
  const auto side = static_cast<std::int64_t>(std::sqrt(static_cast<double>(count)));
  for (std::int64_t i = 0; i < count; ++i) {
    const double x = step * static_cast<double>(i % side);
    const double y = step * static_cast<double>(i / side);
    points.push_back(Eigen::Vector3d(x, y, -20.0 + std::sin(x) * std::cos(0.7 * y)).cast<float>());
  }
  return points;
}

void write_pcd(const std::string& path, const std::vector<Eigen::Vector3f>& points, bool is_text) {
  std::ofstream file(path, std::ios::binary);
  file << fmt::format(
      "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS {}\nWIDTH {}\nHEIGHT 1\nDATA {}\n",
      points.size(), points.size(), is_text ? "ascii" : "binary");
  for (const Eigen::Vector3f& p : points) {
    if (is_text) {
      file << fmt::format("{} {} {}\n", p.x(), p.y(), p.z());
    } else {
      file.write(reinterpret_cast<const char*>(p.data()), sizeof(p));
    }
  }
}

void read_pcd(benchmark::State& state, bool is_text) {
  const std::string path =
      (std::filesystem::temp_directory_path() / fmt::format("dive_cloud_bench_{}.pcd", getpid()))
          .string();
  write_pcd(path, sea_bed(state.range(0)), is_text);
  for (auto _ : state) {
    const auto cloud = dive::planning::read_cloud(path, {.unit_m = 1.0});
    if (!cloud) state.SkipWithError(cloud.error().c_str());
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
  std::filesystem::remove(path);
}

void BM_ReadBinaryPcd(benchmark::State& state) { read_pcd(state, false); }
void BM_ReadAsciiPcd(benchmark::State& state) { read_pcd(state, true); }
BENCHMARK(BM_ReadBinaryPcd)->Arg(1'000'000)->Arg(10'000'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_ReadAsciiPcd)->Arg(1'000'000)->Unit(benchmark::kMillisecond);

// From the file to the pieces: a bed a kilometre wide, and the region around a 30 m path on it.
void make_world(benchmark::State& state, const Eigen::AlignedBox3d& region) {
  const std::string path =
      (std::filesystem::temp_directory_path() / fmt::format("dive_world_bench_{}.pcd", getpid()))
          .string();
  const double step = 1000.0 / std::sqrt(static_cast<double>(state.range(0)));
  write_pcd(path, sea_bed(state.range(0), step), false);
  for (auto _ : state) {
    const auto made = dive::planning::world_from_cloud(path, {.unit_m = 1.0}, {.region = region});
    if (!made) {
      state.SkipWithError(made.error().c_str());
      break;
    }
    state.counters["pieces"] = static_cast<double>(made->world.obstacles.size());
    state.counters["voxel_m"] = made->voxel_m;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["most_mb"] = static_cast<double>(usage.ru_maxrss) / 1024.0;
  std::filesystem::remove(path);
}

void BM_WorldOfPart(benchmark::State& state) {
  make_world(state, Eigen::AlignedBox3d(Eigen::Vector3d(475.0, 475.0, -50.0),
                                        Eigen::Vector3d(555.0, 525.0, 0.0)));
}
void BM_WorldOfAll(benchmark::State& state) { make_world(state, {}); }
BENCHMARK(BM_WorldOfPart)->Arg(1'000'000)->Arg(10'000'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_WorldOfAll)->Arg(1'000'000)->Arg(10'000'000)->Unit(benchmark::kMillisecond);

}  // namespace
