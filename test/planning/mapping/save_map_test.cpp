// A map observed, saved and loaded again: measured piece by piece here.

#include "planning/mapping/save_map.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/random.h"
#include "planning/cloud/cloud_file.h"
#include "planning/mapping/mapper.h"
#include "planning/world/sdf.h"

namespace dive::planning {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Eigen::Vector3f;
using ::testing::HasSubstr;

/// A temporary folder of its own.
class Scratch {
 public:
  Scratch() { fs::create_directories(folder_); }
  ~Scratch() { fs::remove_all(folder_); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::vector<fs::path> files() const {
    std::vector<fs::path> names;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

 private:
  fs::path folder_ = fs::temp_directory_path() /
                     fmt::format("dive_saved_{}_{}", getpid(),
                                 ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

/// Distance to the hull of points on a plane, in order, with a radius about it; one point or two
/// are allowed.
double to_piece(const Vector3d& p, const std::vector<Vector3d>& v, double radius) {
  const auto to_segment = [&](const Vector3d& a, const Vector3d& b) {
    const double length2 = (b - a).squaredNorm();
    const double t = length2 > 0.0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
    return (p - a - t * (b - a)).norm();
  };
  Vector3d normal = Vector3d::Zero();
  double least = (p - v[0]).norm();
  for (std::size_t i = 0; i < v.size(); ++i) {
    const Vector3d& next = v[(i + 1) % v.size()];
    least = std::min(least, to_segment(v[i], next));
    normal += (v[i] - v[0]).cross(next - v[0]);
  }
  if (normal.norm() < 1e-12) return least - radius;
  normal.normalize();
  bool inside = true;
  for (std::size_t i = 0; i < v.size(); ++i) {
    inside &= (v[(i + 1) % v.size()] - v[i]).cross(p - v[i]).dot(normal) >= 0.0;
  }
  return (inside ? std::abs(normal.dot(p - v[0])) : least) - radius;
}

std::vector<Polytope> polytopes_of(const ObservedMap& map) {
  std::vector<Polytope> polytopes;
  map.visit_cells([&](CellKey, std::span<const ObservedMap::Piece> pieces) {
    for (const auto& piece : pieces) polytopes.push_back(std::get<Polytope>(piece.obstacle.shape));
  });
  return polytopes;
}

double to_seen(const Vector3d& p, const ObservedMap& map) {
  double least = std::numeric_limits<double>::infinity();
  for (const Polytope& piece : polytopes_of(map)) {
    least = std::min(least, to_piece(p, piece.vertices, piece.radius));
  }
  return least;
}

double to_loaded(const Vector3d& p, const World& world) {
  double least = std::numeric_limits<double>::infinity();
  for (const Obstacle& obstacle : world.obstacles) {
    const auto& piece = std::get<Polytope>(obstacle.shape);
    least = std::min(least, to_piece(p - obstacle.X_WO.p, piece.vertices, piece.radius));
  }
  return least;
}

/// Distance to the triangles, which are kept for checks that must not rely on the pieces.
double to_surfaces(const Vector3d& p, const World& world) {
  double least = std::numeric_limits<double>::infinity();
  for (const Surface& surface : world.surfaces) {
    for (const auto& t : surface.mesh.triangles) {
      least = std::min(least, to_piece(p,
                                       {surface.mesh.vertices[t[0]], surface.mesh.vertices[t[1]],
                                        surface.mesh.vertices[t[2]]},
                                       0.0));
    }
  }
  return least;
}

/// A corner of a room, observed by rays from within, and a post too thin to be a surface.
struct Seen {
  Seen() {
    for (int sweep = 0; sweep < 6; ++sweep) {
      RangeScan scan;
      scan.utime = 1 + 500'000 * sweep;
      scan.origin_B = Vector3f::Zero();
      scan.reach = 10.0F;
      for (int row = 0; row < 75; ++row) {
        for (int column = 0; column < 100; ++column) {
          const Vector3d way =
              Vector3d(1.0, 1.6 * (1.0 - (column + 0.5) / 50.0), 1.0 - (row + 0.5) / 37.5)
                  .normalized();
          double range = std::min(4.0 / way.x(), 20.0);
          if (way.y() > 0.0) range = std::min(range, 2.0 / way.y());
          if (way.z() < 0.0) range = std::min(range, -1.5 / way.z());
          if (column == 61) range = std::min(range, 2.0);
          range += 1e-4 * random.normal();
          scan.points_B.push_back((range * way).cast<float>());
        }
      }
      const auto result =
          mapper.add(scan, {{Vector3d(3.0, -2.0, -6.0), Eigen::Quaterniond::Identity()}});
      EXPECT_TRUE(result && map.apply(result->obstacles));
    }
  }

  static MapperOptions options() {
    MapperOptions options;
    options.points_per_update = 1'000'000;
    options.min_neighbours = 0;
    return options;
  }

  SteadyClock clock;
  Random random{5};
  Mapper mapper{RobotHull{}, options(), clock};
  ObservedMap map;
};

std::vector<Vector3d> places() {
  Random random(11);
  std::vector<Vector3d> places;
  for (int i = 0; i < 400; ++i) {
    places.emplace_back(random.uniform(2.5, 8.0), random.uniform(-6.0, 1.0),
                        random.uniform(-8.5, -4.0));
  }
  return places;
}

std::optional<World> load(const std::string& path) {
  Diagnostics diagnostics;
  std::optional<World> world = load_sdf(path, diagnostics);
  for (const Diagnostic& diagnostic : diagnostics.list()) ADD_FAILURE() << diagnostic.message;
  return world;
}

TEST(SaveMapTest, WhatIsLoadedAgainIsWhatWasObserved) {
  const Seen seen;
  ASSERT_GT(seen.map.pieces(), 20U);
  const Scratch scratch;
  const auto saved = save_map(scratch.path("the wreck"), seen.map, seen.mapper.points(), "dive 7",
                              Existing::kRefuse);
  ASSERT_TRUE(saved.has_value()) << saved.error().message;
  ASSERT_EQ(scratch.files().size(), 4U);

  const std::optional<World> world = load(scratch.path("the wreck.sdf"));
  ASSERT_TRUE(world.has_value());
  EXPECT_EQ(world->obstacles.size(), seen.map.pieces());
  EXPECT_EQ(scratch.files().size(), 4U) << "the pieces were made again";
  double apart = 0.0;
  for (const Vector3d& p : places()) {
    const double measured = to_loaded(p, *world);
    const double truth = to_seen(p, seen.map);
    apart = std::max(apart, std::abs(measured - truth));
    EXPECT_LE(measured, truth + 1e-9) << "nearer is safe, farther is not";
  }
  EXPECT_LE(apart, 1e-5);

  const auto cloud = read_cloud(scratch.path("the wreck.cloud.ply"), {.unit_m = 1.0});
  ASSERT_TRUE(cloud.has_value()) << cloud.error();
  EXPECT_EQ(cloud->points, seen.mapper.points());
}

TEST(SaveMapTest, WithoutThePiecesTheMeshWillDo) {
  const Seen seen;
  const Scratch scratch;
  ASSERT_TRUE(save_map(scratch.path("wreck"), seen.map, {}, "", Existing::kRefuse).has_value());
  double thickest = 0.0;
  for (const Polytope& piece : polytopes_of(seen.map)) thickest = std::max(thickest, piece.radius);
  for (const fs::path& name : scratch.files()) {
    if (name.extension() == ".pieces") fs::remove(scratch.path(name));
  }
  const std::optional<World> world = load(scratch.path("wreck.sdf"));
  ASSERT_TRUE(world.has_value());
  for (const Vector3d& p : places()) {
    const double truth = to_seen(p, seen.map);
    // The mesh itself has no skin; its decomposition reaches up to 0.05 m beyond it.
    EXPECT_NEAR(to_surfaces(p, *world), truth + 0.5 * thickest, 0.5 * thickest + 1e-5);
    EXPECT_EQ(world->obstacles.empty(), false);
  }
}

TEST(SaveMapTest, NamesAreEscapedOrRefused) {
  const Seen seen;
  const Scratch scratch;
  for (const std::string name : {"a & b <c> \"d\" 'e'", "100 %20 -- ü#?", "wreck.v2"}) {
    const auto saved =
        save_map(scratch.path(name), seen.map, {}, "-- > --> <!-- \n \xFF & -", Existing::kRefuse);
    ASSERT_TRUE(saved.has_value()) << saved.error().message;
    const std::optional<World> world = load(scratch.path(name + ".sdf"));
    ASSERT_TRUE(world.has_value()) << name;
    EXPECT_EQ(world->obstacles.size(), seen.map.pieces()) << name;
  }
  for (const std::string name : {" wreck", "wreck ", "two\nlines", "\xFFwreck", ""}) {
    EXPECT_FALSE(save_map(scratch.path(name), seen.map, {}, "", Existing::kRefuse).has_value())
        << name;
  }
}

TEST(SaveMapTest, ReportsWhyThereIsNoMap) {
  const Scratch scratch;
  EXPECT_THAT(
      save_map(scratch.path("wreck"), ObservedMap{}, {}, "", Existing::kRefuse).error().message,
      HasSubstr("nothing"));
  const Seen seen;
  EXPECT_THAT(
      save_map(scratch.path("nowhere/wreck"), seen.map, {}, "", Existing::kRefuse).error().message,
      HasSubstr("cannot be written"));
  EXPECT_TRUE(scratch.files().empty());
}

}  // namespace
}  // namespace dive::planning
