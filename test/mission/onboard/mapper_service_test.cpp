#include "mission/onboard/mapper_service.h"

#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "planning/world/observed_map.h"
#include "test/vehicle/aqua2.h"

namespace dive::mission {
namespace {

constexpr Utime kTick = 20'000;

estimation::StateEstimate estimate_with(double attitude_sigma) {
  estimation::StateEstimate estimate;
  estimate.utime = kTick;
  estimate.valid = true;
  estimate.X_WB.p.z() = -3.0;
  estimate.covariance.setIdentity();
  estimate.covariance *= 1e-4;
  estimate.covariance(4, 4) = attitude_sigma * attitude_sigma;
  return estimate;
}

RangeScan wall_ahead() {
  RangeScan scan;
  scan.utime = kTick;
  for (int y = -10; y <= 10; ++y) {
    for (int z = -10; z <= 10; ++z) {
      scan.points_B.emplace_back(3.0F, 0.1F * static_cast<float>(y), 0.1F * static_cast<float>(z));
    }
  }
  return scan;
}

bool is_mapped(const estimation::StateEstimate& estimate) {
  const vehicle::Model& model = dive::testing::aqua2();
  MapperService service(model.hull, {}, nullptr, kTick);
  service.observe(estimate);
  service.submit(wall_ahead(), kTick);
  return service.poll(3 * kTick).scan.has_value();
}

TEST(MapperService, MapsNothingWhileTheAttitudeIsPredicted) {
  EXPECT_TRUE(is_mapped(estimate_with(0.01)));
  EXPECT_TRUE(is_mapped(estimate_with(0.25)));
  EXPECT_FALSE(is_mapped(estimate_with(0.35))) << "about one axis is enough";
  EXPECT_FALSE(is_mapped(estimation::StateEstimate{})) << "not valid";
}

// The correction changes between the time of the scan and its mapping.
TEST(MapperService, PlacesAScanByTheNewestCorrection) {
  const vehicle::Model& model = dive::testing::aqua2();
  MapperService service(model.hull, {}, nullptr, kTick);
  constexpr int kScans = 6;  // a voxel is not confirmed by one
  constexpr Utime kScan = 200'000;
  estimation::StateEstimate estimate = estimate_with(0.01);
  for (int i = 0; i < kScans; ++i, estimate.utime += kScan) service.observe(estimate);
  estimate.map_from_odom = {std::numbers::pi / 2.0, {0.0, 10.0}};
  estimate.X_WB = estimate.map_from_odom * estimate.X_WB;
  service.observe(estimate);
  std::vector<planning::MapCell> cells;
  for (int i = 1; i <= kScans; ++i) {
    RangeScan scan = wall_ahead();
    scan.utime = kTick + (i - 1) * kScan;
    scan.points_B.front().z() += 0.001F * static_cast<float>(i);  // else it counts as frozen
    service.submit(std::move(scan), (i + kScans) * kScan);
    const auto result = service.poll((i + kScans) * kScan + kTick).scan;
    ASSERT_TRUE(result) << i;
    const std::vector<planning::MapCell>& changed = result->obstacles.cells;
    cells.insert(cells.end(), changed.begin(), changed.end());
  }
  ASSERT_FALSE(cells.empty());
  for (const planning::MapCell& cell : cells) {
    for (const planning::Polytope& piece : cell.pieces) {
      for (const Eigen::Vector3d& vertex : piece.vertices) {
        EXPECT_NEAR(vertex.y(), 13.0, 0.3) << "3 m ahead of a bow that points north from (0, 10)";
        EXPECT_NEAR(vertex.x(), 0.0, 1.3);
      }
    }
  }
}

// The scans before and after the move are of one wall; the pose is published as before until the
// owner of the estimate has the result.
TEST(MapperService, MovesTheMapAndPlacesTheNextScansAccordingly) {
  MapperService service(dive::testing::aqua2().hull, {}, nullptr, kTick);
  planning::ObservedMap map;
  estimation::StateEstimate estimate = estimate_with(0.01);
  const auto map_wall = [&] {
    RangeScan scan = wall_ahead();
    scan.utime = estimate.utime;
    scan.points_B.front().z() += 1e-3F * static_cast<float>(to_seconds(estimate.utime));
    service.observe(estimate);
    service.submit(std::move(scan), estimate.utime);
  };
  const auto apply = [&](const MapperResult& result) {
    if (result.scan) static_cast<void>(map.apply(result.scan->obstacles));
    if (result.moved) {
      ASSERT_TRUE(map.apply(result.moved->obstacles));
    }
  };
  for (int i = 0; i < 6; ++i, estimate.utime += 10 * kTick) {
    map_wall();
    apply(service.poll(estimate.utime + kTick));
  }
  const PlanarTransform by{0.0, {0.0, 20.0}};
  service.move({{{0, by}}}, estimate.utime);
  map_wall();  // not published yet
  const MapperResult moved = service.poll(estimate.utime + kTick);
  ASSERT_TRUE(moved.moved);
  EXPECT_EQ(moved.moved->correction.newest().translation, by.translation);
  apply(moved);
  apply(service.poll(estimate.utime + 2 * kTick));
  estimate.map_from_odom = by;
  estimate.X_WB = by * estimate.X_WB;
  for (int i = 0; i < 6; ++i) {
    estimate.utime += 10 * kTick;
    map_wall();
    apply(service.poll(estimate.utime + kTick));
  }
  ASSERT_GT(map.pieces(), 0U);
  std::vector<planning::Obstacle> pieces;
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(100.0);
  map.append_within({-far, far}, pieces);
  for (const planning::Obstacle& piece : pieces) {
    for (const Eigen::Vector3d& vertex : std::get<planning::Polytope>(piece.shape).vertices) {
      EXPECT_NEAR(vertex.x(), 3.0, 0.1);
      EXPECT_NEAR(vertex.y(), 20.0, 1.3);
    }
  }
}

TEST(MapperService, MapsWhatIsWhereAnObjectOfTheMapHasGone) {
  planning::World world;
  world.obstacles.push_back({"wall", planning::Box{{0.2, 4.0, 4.0}}, Pose{{3.0, 0.0, -3.0}}});
  const auto known = std::make_shared<const planning::MapSurface>(world);
  for (const bool is_absent : {false, true}) {
    MapperService service(dive::testing::aqua2().hull, {}, known, kTick);
    planning::AbsentObjects absent;
    if (is_absent) absent.apply(std::vector<planning::ObjectChange>{{0, 1, true}});
    service.set_absent(absent);
    bool is_mapped = false;
    for (int i = 1; i <= 6; ++i) {
      estimation::StateEstimate estimate = estimate_with(0.001);
      estimate.utime = i * 10 * kTick;
      service.observe(estimate);
      RangeScan scan = wall_ahead();
      scan.utime = estimate.utime;
      scan.points_B.front().z() += 0.001F * static_cast<float>(i);
      service.submit(std::move(scan), estimate.utime);
      const auto result = service.poll(estimate.utime + kTick).scan;
      is_mapped |= result && !result->obstacles.cells.empty();
    }
    EXPECT_EQ(is_mapped, is_absent);
  }
}

}  // namespace
}  // namespace dive::mission
