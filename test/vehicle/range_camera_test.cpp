#include "vehicle/simulator/sensors/range_camera.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "vehicle/simulator/diver.h"

namespace dive::vehicle {
namespace {

using planning::Box;
using planning::HalfSpace;
using planning::World;

constexpr int kWidth = 100;
constexpr int kHeight = 75;
constexpr double kNone = 20.0;  // m, the mark of a ray that finds nothing within 10 m
const Eigen::Vector3d kLens(0.31, 0, 0);

Pose at(double x, double y, double z, double yaw = 0.0) {
  return {Eigen::Vector3d(x, y, z), from_rpy(0, 0, yaw)};
}

RangeCameraOptions exact() {
  RangeCameraOptions options;
  options.noise_m = options.noise_share = options.dropout_share = options.particles_per_m3 = 0.0;
  return options;
}

World floor_at(double z) { return {{{"floor", HalfSpace{Eigen::Vector3d::UnitZ()}, at(0, 0, z)}}}; }

RangeScan scan_of(const World& world, const Pose& X_WB, const std::optional<Pose>& X_WD = {}) {
  RangeCamera camera(world, exact(), 1);
  return camera.take(0, X_WB, X_WD);
}

Eigen::Vector3d ray(const RangeScan& scan, int row, int column) {
  const auto i = static_cast<std::size_t>(row * kWidth + column);
  return (scan.points_B[i] - scan.origin_B).cast<double>();
}

std::vector<double> ranges(const RangeScan& scan) {
  std::vector<double> result;
  for (const Eigen::Vector3f& p : scan.points_B) {
    result.push_back((p - scan.origin_B).cast<double>().norm());
  }
  return result;
}

std::size_t blind(const RangeScan& scan) {
  std::size_t count = 0;
  for (const Eigen::Vector3f& p : scan.points_B) count += p.array().isNaN().any() ? 1U : 0U;
  return count;
}

bool same_bits(const RangeScan& a, const RangeScan& b) {
  return a.points_B.size() == b.points_B.size() &&
         std::memcmp(a.points_B.data(), b.points_B.data(),
                     a.points_B.size() * sizeof(Eigen::Vector3f)) == 0;
}

// Direction of a pixel in B, by angles.
Eigen::Vector3d direction(int row, int column) {
  const double left = std::sqrt(3.0) * (49.5 - column) / 50.0;
  const double up = (37 - row) / 37.5;
  const double tilt = deg_to_rad(40.0);
  return Eigen::Vector3d(std::cos(tilt) + up * std::sin(tilt), left,
                         up * std::cos(tilt) - std::sin(tilt))
      .normalized();
}

TEST(RangeCamera, IsMountedBetweenTheFrontCamerasAndPointsDown) {
  const RangeScan scan = scan_of({}, at(0, 0, -50));
  ASSERT_EQ(scan.points_B.size(), kWidth * kHeight);
  EXPECT_LT((scan.origin_B - Eigen::Vector3f(0.31F, 0, 0)).norm(), 1e-6);
  EXPECT_EQ(scan.reach, 10.0F);
  const auto below_horizon = [&](int row, int column) {
    return rad_to_deg(std::asin(-ray(scan, row, column).z() / kNone));
  };
  EXPECT_NEAR(0.5 * (below_horizon(37, 49) + below_horizon(37, 50)), 40.0, 0.01);
  EXPECT_NEAR(below_horizon(0, 50), -5.0, 0.5);
  EXPECT_NEAR(below_horizon(74, 50), 85.0, 0.5);
  const double across = std::acos(ray(scan, 37, 0).dot(ray(scan, 37, 99)) / (kNone * kNone));
  EXPECT_NEAR(rad_to_deg(across), 120.0, 1.2);
  EXPECT_GT(ray(scan, 37, 0).y(), 0.0);  // from the left
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      ASSERT_NEAR((ray(scan, row, column) - kNone * direction(row, column)).norm(), 0.0, 1e-4);
    }
  }
}

// A floor as a half-space and as the top of a box, for a vehicle at any attitude.
TEST(RangeCamera, MeasuresAFlatFloor) {
  const World box{{{"floor", Box{{80, 80, 2}}, at(0, 0, -13)}}};
  for (const World& world : {floor_at(-12.0), box}) {
    for (const Pose& X_WB : {at(1, 2, -8, 0.7), Pose{{1, 2, -9}, from_rpy(0.9, 0.4, -2)},
                             Pose{{1, 2, -10}, from_rpy(-1.5, -0.8, 0)}}) {
      const std::vector<double> measured = ranges(scan_of(world, X_WB));
      const double height = (X_WB * kLens).z() + 12.0;
      for (int i = 0; i < kWidth * kHeight; ++i) {
        const double sink = -(X_WB.q * direction(i / kWidth, i % kWidth)).z();
        const double range = sink > 0.0 ? height / sink : kNone;
        if (std::abs(range - 10.0) < 1e-4) continue;  // either result is correct
        ASSERT_NEAR(measured[static_cast<std::size_t>(i)], range < 10.0 ? range : kNone, 1e-4) << i;
      }
    }
  }
}

// The ray of a camera that is turned in its mount meets the floor elsewhere than it reports.
TEST(RangeCamera, MisalignedItMeasuresAlongOtherRaysThanItReports) {
  RangeCameraOptions options = exact();
  options.misalignment_deg = {0.0, 2.0, 0.0};
  RangeCamera camera(floor_at(-12.0), options, 1);
  const RangeScan scan = camera.take(0, at(0, 0, -8));
  for (const int row : {10, 37, 70}) {
    const double below = std::asin(-direction(row, 50).z()) + deg_to_rad(2.0);
    const double across = std::abs(direction(row, 50).y());
    EXPECT_LT(across, 0.02) << "in the middle the ray is turned in its own plane";
    const double range = ((at(0, 0, -8) * kLens).z() + 12.0) / std::sin(below);
    EXPECT_NEAR(ray(scan, row, 50).norm(), range < 10.0 ? range : kNone, 0.02);
    EXPECT_LT((ray(scan, row, 50).cast<double>().normalized() - direction(row, 50)).norm(), 1e-5);
  }
}

TEST(RangeCamera, TheMisalignmentOfAVehicleIsDrawnAboutEachAxis) {
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    const RangeCameraOptions drawn = drawn_range_camera({}, 0.3, seed);
    sum += drawn.misalignment_deg.squaredNorm() / 3.0;
  }
  EXPECT_NEAR(std::sqrt(sum / 400.0), 0.3, 0.02);
  EXPECT_EQ(drawn_range_camera({}, 0.0, 7).misalignment_deg, Eigen::Vector3d::Zero());
}

// Range of a box by slabs (Kay and Kajiya 1986), infinity for a miss.
double slabs(const Eigen::Vector3d& size, const Pose& X_WO, const Eigen::Vector3d& o_W,
             const Eigen::Vector3d& d_W) {
  const Eigen::Vector3d o = X_WO.inverse() * o_W;
  const Eigen::Vector3d d = X_WO.q.inverse() * d_W;
  double in = 0.0;
  double out = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const double a = (-0.5 * size[k] - o[k]) / d[k];
    const double b = (0.5 * size[k] - o[k]) / d[k];
    in = std::max(in, std::min(a, b));
    out = std::min(out, std::max(a, b));
  }
  return in < out ? in : std::numeric_limits<double>::infinity();
}

TEST(RangeCamera, MeasuresTheNearestOfManyBoxes) {
  Random random(5);
  std::size_t met = 0;
  for (int run = 0; run < 20; ++run) {
    World world;
    std::vector<Eigen::Vector3d> sizes;
    for (int i = 0; i < 25; ++i) {
      sizes.emplace_back(random.uniform(0.1, 2), random.uniform(0.1, 2), random.uniform(0.1, 2));
      const Eigen::Vector3d p(random.uniform(2, 12), random.uniform(-6, 6),
                              random.uniform(-30, -20));
      world.obstacles.push_back({"box", Box{sizes.back()}, {p, from_rpy(random.normal(), 1, 2)}});
    }
    const Pose X_WB{{0, 0, -23}, from_rpy(random.uniform(-0.5, 0.5), 0.1, 0.2)};
    const std::vector<double> measured = ranges(scan_of(world, X_WB));
    int wrong = 0;
    for (int i = 0; i < kWidth * kHeight; ++i) {
      double least = 10.0;
      for (std::size_t k = 0; k < sizes.size(); ++k) {
        least = std::min(least, slabs(sizes[k], world.obstacles[k].X_WO, X_WB * kLens,
                                      X_WB.q * direction(i / kWidth, i % kWidth)));
      }
      met += least < 10.0 ? 1U : 0U;
      const double expected = least < 10.0 ? least : kNone;
      wrong += std::abs(measured[static_cast<std::size_t>(i)] - expected) < 2e-4 ? 0 : 1;
    }
    EXPECT_LE(wrong, 2);  // rays that pass within rounding of an edge
  }
  EXPECT_GT(met, 20'000U);
}

// The camera faces a valley of two plates, with the hull of both as the obstacle.
TEST(RangeCamera, MeasuresTheMeshAndNotItsPieces) {
  const std::vector<Eigen::Vector3d> corners{{1, -5, -12}, {1, 5, -12},  {5, -5, -16},
                                             {5, 5, -16},  {9, -5, -12}, {9, 5, -12}};
  World world;
  world.obstacles.push_back({"valley", planning::Polytope{corners, 0.01}, {}, 0});
  world.surfaces.push_back(
      {"valley", {corners, {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}, {3, 5, 4}}}});  // normals either way
  const Pose X_WB = at(4, 0, -10);
  const RangeScan scan = scan_of(world, X_WB);
  int in_valley = 0;
  for (const Eigen::Vector3f& p : scan.points_B) {
    if ((p - scan.origin_B).norm() > scan.reach) continue;
    const Eigen::Vector3d p_W = X_WB * p.cast<double>();
    ASSERT_NEAR(p_W.z(), -16.0 + std::abs(p_W.x() - 5.0), 1e-4);
    in_valley += p_W.z() < -13.0 ? 1 : 0;
  }
  EXPECT_GT(in_valley, 1000);

  world.surfaces.clear();  // as in a log: the lid of the hull
  const std::vector<double> measured = ranges(scan_of(world, X_WB));
  int on_lid = 0;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const Eigen::Vector3d d = direction(i / kWidth, i % kWidth);
    const Eigen::Vector3d lid = X_WB * kLens - d * (1.99 / d.z());
    if (d.z() > -0.01 || std::abs(lid.x() - 5) > 3.9 || std::abs(lid.y()) > 4.9) continue;
    ASSERT_NEAR(measured[static_cast<std::size_t>(i)], 1.99 / -d.z(), 1e-4);
    ++on_lid;
  }
  EXPECT_GT(on_lid, 3000);
}

TEST(RangeCamera, MeasuresNothingAboveTheWater) {
  World world = floor_at(-30.0);
  world.obstacles.push_back({"quay", Box{{2, 40, 6}}, at(6, 0, 0)});  // z from -3 to 3
  const Pose nose_up{{0, 0, -1}, from_rpy(0, deg_to_rad(-60), 0)};
  const RangeScan scan = scan_of(world, nose_up);
  int wall = 0;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const Eigen::Vector3d d = nose_up.q * direction(i / kWidth, i % kWidth);
    const Eigen::Vector3d o = nose_up * kLens;
    const double to_wall = (5.0 - o.x()) / d.x();
    const double z = o.z() + to_wall * d.z();
    const bool met = d.x() > 0.0 && to_wall < 10.0 && z < 0.0 && z > -3.0;
    if (std::abs(z) < 1e-4) continue;
    ASSERT_NEAR(ray(scan, i / kWidth, i % kWidth).norm(), met ? to_wall : kNone, 1e-4);
    wall += met ? 1 : 0;
  }
  EXPECT_GT(wall, 100);

  // Above the surface the camera measures what is below and gives no range elsewhere.
  const RangeScan above = scan_of(world, at(0, 0, 0.5));
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const Eigen::Vector3d measured = ray(above, i / kWidth, i % kWidth);
    if (direction(i / kWidth, i % kWidth).z() >= -0.05) {
      ASSERT_TRUE(std::isnan(measured.x()));
    } else if (measured.norm() < 10.0) {
      ASSERT_LE(0.5 + measured.z(), 1e-4);
    }
  }
  EXPECT_LT(blind(above), kWidth * kHeight / 2U);
}

TEST(RangeCamera, IsBlindInsideASolid) {
  const World rock{{{"rock", planning::Sphere{2.0}, at(0, 0, -10)}}};
  EXPECT_EQ(blind(scan_of(rock, at(1, 0, -10))), kWidth * kHeight);
  EXPECT_EQ(blind(scan_of(rock, at(2, 0, -10))), 0U);
  EXPECT_EQ(blind(scan_of(floor_at(-5), at(0, 0, -5.1))), kWidth * kHeight);
  EXPECT_EQ(blind(scan_of({}, at(0, 0, -10), at(0.9, 0.2, -10))), kWidth * kHeight);
  EXPECT_EQ(blind(scan_of({}, at(0, 0, -10), at(0.9, 0.4, -10))), 0U);
}

TEST(RangeCamera, NoiseAndDropoutsAreAsStated) {
  RangeCameraOptions options = exact();
  options.noise_m = 0.01;
  options.noise_share = 0.005;
  options.dropout_share = 0.02;
  RangeCamera camera(floor_at(-12), options, 3);
  const Pose X_WB = at(0, 0, -8);
  const std::vector<double> truth = ranges(scan_of(floor_at(-12), X_WB));
  double sum = 0.0;
  double squares = 0.0;
  double near = 0.0;
  double dropped = 0.0;
  constexpr int kScans = 20;
  for (int k = 0; k < kScans; ++k) {
    const RangeScan scan = camera.take(k * 100'000, X_WB);
    const std::vector<double> measured = ranges(scan);
    dropped += static_cast<double>(blind(scan));
    for (std::size_t i = 0; i < measured.size(); ++i) {
      if (std::isnan(measured[i])) continue;
      if (truth[i] > 10.0) {
        ASSERT_NEAR(measured[i], kNone, 1e-4);
        continue;
      }
      ASSERT_LE((scan.points_B[i] - scan.origin_B).norm(), scan.reach);  // a wall remains
      if (truth[i] > 9.5) continue;                                      // truncated by the reach
      const double error = (measured[i] - truth[i]) / (0.01 + 0.005 * truth[i]);
      sum += error;
      squares += error * error;
      near += 1.0;
    }
  }
  ASSERT_GT(near, 50'000);
  EXPECT_NEAR(sum / near, 0.0, 5.0 / std::sqrt(near));
  EXPECT_NEAR(squares / near, 1.0, 5.0 * std::sqrt(2.0 / near));
  const double pixels = kScans * kWidth * kHeight;
  EXPECT_NEAR(dropped / pixels, 0.02, 5.0 * std::sqrt(0.02 * 0.98 / pixels));
}

TEST(RangeCamera, SameSeedSameScans) {
  RangeCamera a(floor_at(-9), {}, 7);
  RangeCamera b(floor_at(-9), {}, 7);
  RangeCamera c(floor_at(-9), {}, 8);
  for (int k = 0; k < 10; ++k) {
    const Pose X_WB = at(0.04 * k, 0, -7, 0.01 * k);
    const RangeScan scan = a.take(k * 100'000, X_WB, at(3, 0, -8));
    EXPECT_TRUE(same_bits(scan, b.take(k * 100'000, X_WB, at(3, 0, -8))));
    EXPECT_FALSE(same_bits(scan, c.take(k * 100'000, X_WB, at(3, 0, -8))));
    if (k == 5) {
      RangeCamera moved(std::move(b));
      b = std::move(moved);
    }
  }
}

// Before a visible floor a few pixels have shorter ranges; a moment later the particles have moved
// by at most the drift, and after a minute they are different ones.
TEST(RangeCamera, ParticlesDriftBeforeTheFloor) {
  RangeCameraOptions options = exact();
  options.particles_per_m3 = 0.5;
  const Pose X_WB = at(0, 0, -8);
  const std::vector<double> clear = ranges(scan_of(floor_at(-14), X_WB));
  RangeCamera camera(floor_at(-14), options, 11);
  const auto before_floor = [&](const std::vector<double>& measured) {
    std::vector<std::size_t> pixels;
    for (std::size_t i = 0; i < measured.size(); ++i) {
      EXPECT_LE(measured[i], clear[i] + 1e-6);
      if (measured[i] < clear[i] - 1e-3) pixels.push_back(i);
    }
    return pixels;
  };
  const std::vector<double> first = ranges(camera.take(0, X_WB));
  const std::vector<double> again = ranges(camera.take(0, X_WB));
  const std::vector<double> soon = ranges(camera.take(20'000, X_WB));
  const std::vector<double> late = ranges(camera.take(60'000'000, X_WB));
  const std::vector<std::size_t> pixels = before_floor(first);
  // The frustum contains about a fifth of 216 m^3, each particle one pixel or a few.
  EXPECT_GT(pixels.size(), 8U);
  EXPECT_LT(pixels.size(), 300U);
  EXPECT_EQ(again, first);
  EXPECT_NE(soon, first);
  std::size_t stayed = 0;
  for (const std::size_t i : pixels) {
    if (soon[i] == clear[i]) continue;
    ++stayed;
    EXPECT_NEAR(soon[i], first[i], 0.05 * 0.02 * std::sqrt(1.0 + 3.0 + 1.0) + 1e-6);
  }
  EXPECT_GT(stayed, pixels.size() / 2);
  EXPECT_NE(before_floor(late), pixels);
  EXPECT_GT(before_floor(late).size(), 8U);

  options.particle_drift = 0.0;
  RangeCamera still(floor_at(-14), options, 11);
  EXPECT_EQ(ranges(still.take(0, X_WB)), ranges(still.take(60'000'000, X_WB)));
}

// The range of a capsule, by the distance from its axis, with nothing behind it.
TEST(RangeCamera, MeasuresTheDiverBeforeTheFloor) {
  const Pose X_WB = at(0, 0, -8);
  const Pose X_WD = at(2.2, 0.1, -9, 1.2);
  const std::vector<double> clear = ranges(scan_of(floor_at(-12), X_WB));
  const RangeScan scan = scan_of(floor_at(-12), X_WB, X_WD);
  const std::vector<double> measured = ranges(scan);
  int on_diver = 0;
  for (std::size_t i = 0; i < clear.size(); ++i) {
    const Eigen::Vector3d p_D = X_WD.inverse() * (X_WB * scan.points_B[i].cast<double>());
    const Eigen::Vector3d off(p_D.x() - std::clamp(p_D.x(), -0.6, 0.6), p_D.y(), p_D.z());
    if (std::abs(measured[i] - clear[i]) < 1e-6) {
      ASSERT_GT(off.norm(), 0.3);
      continue;
    }
    ++on_diver;
    ASSERT_LT(measured[i], clear[i]);
    ASSERT_NEAR(off.norm(), 0.3015, 0.0016);
  }
  EXPECT_GT(on_diver, 200);
  EXPECT_TRUE(same_bits(scan_of(floor_at(-12), X_WB, at(2, 0, -20)), scan_of(floor_at(-12), X_WB)));
}

TEST(RangeCamera, FallsDueAtItsRate) {
  for (const double rate : {10.0, 30.0}) {
    RangeCameraOptions options = exact();
    options.rate_hz = rate;
    RangeCamera camera({}, options, 1);
    int scans = 0;
    for (Utime now = 0; now < 10'000'000; now += 20'000) {
      if (!camera.due(now)) continue;
      static_cast<void>(camera.take(now, at(0, 0, -5)));
      EXPECT_FALSE(camera.due(now));
      ++scans;
    }
    EXPECT_EQ(scans, static_cast<int>(10 * rate));
  }
}

TEST(RangeCamera, FrozenItRepeatsItselfUnderNewStamps) {
  RangeCamera camera(floor_at(-10.0), {}, 1);
  camera.set_frozen(true);
  const RangeScan first = camera.take(200'000, at(0, 0, -8));
  EXPECT_FALSE(camera.due(200'000));
  const RangeScan second = camera.take(400'000, at(1, 0, -7));
  EXPECT_EQ(second.utime, 400'000);
  EXPECT_FALSE(camera.due(400'000));
  EXPECT_TRUE(same_bits(first, second));
  camera.set_frozen(false);
  EXPECT_FALSE(same_bits(first, camera.take(600'000, at(1, 0, -7))));
}

TEST(RangeCamera, RefusesOptionsThatMakeNoCamera) {
  EXPECT_EQ(RangeCameraOptions{}.validate(), "");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [](auto change) {
    RangeCameraOptions options;
    change(options);
    EXPECT_NE(options.validate(), "");
  };
  refuses([](RangeCameraOptions& o) { o.width = 0; });
  refuses([](RangeCameraOptions& o) { o.height = -1; });
  refuses([](RangeCameraOptions& o) { o.width = o.height = 300; });
  refuses([](RangeCameraOptions& o) { o.horizontal_deg = 180; });
  refuses([](RangeCameraOptions& o) { o.vertical_deg = 0; });
  refuses([&](RangeCameraOptions& o) { o.tilt_deg = nan; });
  refuses([&](RangeCameraOptions& o) { o.origin_B.z() = nan; });
  refuses([](RangeCameraOptions& o) { o.reach_m = 0; });
  refuses([](RangeCameraOptions& o) { o.rate_hz = 0; });
  refuses([](RangeCameraOptions& o) { o.noise_m = -0.1; });
  refuses([](RangeCameraOptions& o) { o.dropout_share = 1.1; });
  refuses([](RangeCameraOptions& o) { o.particles_per_m3 = 1e9; });
  refuses([&](RangeCameraOptions& o) { o.particle_drift = nan; });
}

}  // namespace
}  // namespace dive::vehicle
