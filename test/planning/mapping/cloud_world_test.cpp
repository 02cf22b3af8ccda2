// Clouds in files as worlds: every point must lie in a piece, tested triangle by triangle here.

#include "planning/mapping/cloud_world.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/random.h"
#include "test/common/sanitizers.h"
#include "test/planning/mapping/flat_distance.h"

namespace dive::planning {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

double to_world(const Vector3d& p_W, const World& world) {
  double least = std::numeric_limits<double>::infinity();
  for (const Obstacle& obstacle : world.obstacles) {
    const Vector3d p = p_W - obstacle.X_WO.p;
    const auto& piece = std::get<Polytope>(obstacle.shape);
    double around = 0.0;
    for (const Vector3d& v : piece.vertices) around = std::max(around, v.norm());
    if (p.norm() - around - piece.radius > least) continue;
    least = std::min(least, to_piece(p, piece));
  }
  return least;
}

/// Largest distance of a point of the file (over `samples` of them) from the pieces; negative if
/// all are in one.
double worst_of(const CloudFile& cloud, const CloudWorld& made, std::size_t samples) {
  double worst = -std::numeric_limits<double>::infinity();
  Random random(7);
  for (std::size_t k = 0; k < samples; ++k) {
    const auto i = static_cast<std::size_t>(
        random.uniform(0.0, static_cast<double>(cloud.points.size()) - 0.5));
    const Vector3d p_W = cloud.origin + cloud.points[i].cast<double>() - made.origin;
    if (made.known_W && !made.known_W->contains(p_W)) continue;
    worst = std::max(worst, to_world(p_W, made.world));
  }
  return worst;
}

/// A wavy bed with points `step` apart.
CloudFile bed(int side, double step, double depth = 20.0) {
  CloudFile cloud;
  for (int i = 0; i < side * side; ++i) {
    const double x = step * (i % side);
    const double y = step * (i / side);
    cloud.points.push_back(
        Vector3d(x, y, -depth + std::sin(0.3 * x) * std::cos(0.2 * y)).cast<float>());
  }
  return cloud;
}

TEST(CloudWorldTest, HoldsEveryPointOfEverySharedCloud) {
  const fs::path folder = DIVE_SHARED_DATA "/clouds";
  if (!fs::exists(folder)) GTEST_SKIP() << "the shared data is not here: " << folder;
  std::vector<fs::path> paths;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  int made_of = 0;
  for (const fs::path& path : paths) {
    const auto cloud = read_cloud(path.string(), {});
    const auto begin = std::chrono::steady_clock::now();
    const auto made = world_from_cloud(path.string(), {}, {});
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    fmt::print("{:<44} ", fs::relative(path, folder).string());
    ASSERT_EQ(made.has_value(), cloud.has_value()) << path;
    if (!made) {
      fmt::print("refused: {}\n", made.error());
      EXPECT_FALSE(made.error().empty());
      continue;
    }
    ++made_of;
    const double worst = worst_of(*cloud, *made, 2000);
    fmt::print("{:>7} points {:>6} pieces, voxel {:.2f} m, edges to {:.2f} m, {:.2f} s, {:.3f} m\n",
               made->points, made->world.obstacles.size(), made->voxel_m, made->longest_edge_m,
               took.count(), worst);
    for (const std::string& warning : made->warnings) fmt::print("    {}\n", warning);
    EXPECT_LE(worst, 1e-4) << path;
    EXPECT_EQ(made->points, cloud->points.size());
    EXPECT_FALSE(made->known_W.has_value());
  }
  EXPECT_EQ(made_of, 12);
}

TEST(CloudWorldTest, ABedIsClosedHoweverSparseAndTheWaterAboveIsFree) {
  for (const double step : {0.05, 0.3, 0.7, 1.5}) {
    const auto made = world_from_cloud(bed(60, step), {});
    ASSERT_TRUE(made.has_value()) << made.error();
    EXPECT_TRUE(made->has_surface);
    EXPECT_EQ(made->origin, Vector3d::Zero());
    const double width = 59.0 * step;
    Random random(3);
    for (int i = 0; i < 300; ++i) {
      const double x = random.uniform(0.1, 0.9) * width;
      const double y = random.uniform(0.1, 0.9) * width;
      const double z = -20.0 + std::sin(0.3 * x) * std::cos(0.2 * y);
      // Sag of a chord two steps long under a bed with a curvature of 0.13 / m.
      const double sag = 0.13 * (2.0 * step) * (2.0 * step) / 8.0;
      EXPECT_LE(to_world({x, y, z}, made->world), sag) << "a hole at step " << step;
      EXPECT_GE(to_world({x, y, z + 0.5 * made->voxel_m + 0.3}, made->world), 0.05 - sag)
          << "thick at step " << step;
    }
  }
}

TEST(CloudWorldTest, ReportsPointsTooFarApartToBeASurface) {
  const auto made = world_from_cloud(bed(20, 4.0), {});
  ASSERT_TRUE(made.has_value());
  EXPECT_THAT(made->warnings, Contains(HasSubstr("taken to be free")));
  EXPECT_LE(worst_of(bed(20, 4.0), *made, 400), 1e-4);
}

TEST(CloudWorldTest, InUtmNothingIsLostAndNamesAreTheFiles) {
  CloudFile cloud = bed(40, 0.1, 8.0);
  cloud.origin = {512'345.0, 6'712'345.0, 0.0};
  const auto made = world_from_cloud(cloud, {});
  ASSERT_TRUE(made.has_value());
  EXPECT_EQ(made->origin, cloud.origin);
  EXPECT_LE(worst_of(cloud, *made, 1600), 1e-4);
  EXPECT_THAT(made->world.obstacles.front().name, StartsWith("cloud at 51234"));
}

TEST(CloudWorldTest, InAirThereIsNoSurface) {
  CloudFile cloud = bed(30, 0.1, 0.0);
  cloud.origin = {0.0, 0.0, 2500.0};
  const auto made = world_from_cloud(cloud, {});
  ASSERT_TRUE(made.has_value());
  EXPECT_FALSE(made->has_surface);
  EXPECT_LE(made->bounds_W.max().z(), -kNoSurface);
  EXPECT_LE(worst_of(cloud, *made, 900), 1e-4);
}

TEST(CloudWorldTest, AHugeCloudIsCutToItsRegionOrMadeCoarser) {
  DIVE_SKIP_UNDER_SANITIZERS("a million points, several times");
  const CloudFile cloud = bed(1000, 0.3);  // a million points, 300 m x 300 m
  const auto begin = std::chrono::steady_clock::now();
  const auto whole = world_from_cloud(cloud, {});
  ASSERT_TRUE(whole.has_value()) << whole.error();
  EXPECT_FALSE(whole->known_W.has_value());
  EXPECT_LE(whole->voxels, CloudWorldOptions{}.max_voxels);
  EXPECT_THAT(whole->warnings, Contains(HasSubstr("it is wide")));
  EXPECT_LE(worst_of(cloud, *whole, 100), 1e-4);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  fmt::print("a million points: {:.1f} s, {} pieces\n", took.count(),
             whole->world.obstacles.size());

  CloudWorldOptions options;
  options.region = Eigen::AlignedBox3d(Vector3d(100.0, 100.0, -25.0), Vector3d(140.0, 130.0, -5.0));
  const auto part = world_from_cloud(cloud, options);
  ASSERT_TRUE(part.has_value()) << part.error();
  ASSERT_TRUE(part->known_W.has_value());
  EXPECT_LT(part->voxel_m, 0.2);
  EXPECT_LT(part->points, 40'000U);
  EXPECT_LE(worst_of(cloud, *part, 10'000), 1e-4);
  EXPECT_THAT(part->warnings, Contains(HasSubstr("left out")));
}

TEST(CloudWorldTest, RefusesWhatItCannotMake) {
  EXPECT_THAT(world_from_cloud(CloudFile{}, {}).error(), HasSubstr("no point"));
  EXPECT_THAT(world_from_cloud(bed(3, 1.0), {.voxel_m = 0.0, .region = {}}).error(),
              HasSubstr("voxel_m"));
  const auto wide = world_from_cloud(bed(40, 5.0), {.max_voxels = 1000, .region = {}});
  ASSERT_FALSE(wide.has_value());
  EXPECT_THAT(wide.error(), HasSubstr("too wide"));
  EXPECT_FALSE(world_from_cloud("nowhere.pcd", {}, {}).has_value());
}

TEST(CloudWorldTest, IsTheSameEveryTime) {
  const CloudFile cloud = bed(150, 0.11);
  const auto one = world_from_cloud(cloud, {});
  const auto other = world_from_cloud(cloud, {});
  ASSERT_TRUE(one && other);
  ASSERT_EQ(one->world.obstacles.size(), other->world.obstacles.size());
  for (std::size_t i = 0; i < one->world.obstacles.size(); ++i) {
    const auto& a = std::get<Polytope>(one->world.obstacles[i].shape);
    const auto& b = std::get<Polytope>(other->world.obstacles[i].shape);
    ASSERT_EQ(a.vertices, b.vertices);
    ASSERT_EQ(a.radius, b.radius);
  }
}

}  // namespace
}  // namespace dive::planning
