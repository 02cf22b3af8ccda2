// What a view of the known map tells, against closed forms and against the simulated range camera.

#include "planning/map_matching/expected_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <Eigen/LU>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "common/random.h"
#include "common/source_text.h"
#include "planning/world/mesh_source.h"
#include "planning/world/sdf.h"
#include "vehicle/simulator/sensors/range_camera.h"

namespace dive::planning {
namespace {

World bare_seabed() {
  World world;
  Pose seabed;
  seabed.p = {0.0, 0.0, -6.0};
  world.obstacles.push_back({"seabed", HalfSpace{Eigen::Vector3d::UnitZ()}, seabed});
  return world;
}

void add_box(World& world, const Eigen::Vector3d& size, const Eigen::Vector3d& centre_W) {
  Pose pose;
  pose.p = centre_W;
  world.obstacles.push_back({"box", Box{size}, pose});
}

const Pose kAbove = {{0.0, 0.0, -4.0}, Eigen::Quaterniond::Identity()};

TEST(ExpectedView, TellsNothingOverABareSeabed) {
  EXPECT_TRUE(std::isinf(ExpectedView(bare_seabed()).worst_sigma(kAbove)));
}

TEST(ExpectedView, TellsNothingAlongASmoothWall) {
  World world = bare_seabed();
  add_box(world, {2.0, 200.0, 20.0}, {5.0, 0.0, -5.0});
  EXPECT_GT(ExpectedView(world).worst_sigma(kAbove), 1.0);
}

TEST(ExpectedView, TellsThePositionInACorner) {
  World world = bare_seabed();
  add_box(world, {2.0, 200.0, 20.0}, {5.0, 0.0, -5.0});
  add_box(world, {20.0, 2.0, 20.0}, {0.0, 4.0, -5.0});
  EXPECT_LT(ExpectedView(world).worst_sigma(kAbove), 0.05);
}

TEST(ExpectedView, DoesNotSeeWhatIsBehindOrOutOfReach) {
  World behind = bare_seabed();
  add_box(behind, {1.0, 1.0, 20.0}, {-3.0, 0.0, -5.0});
  EXPECT_TRUE(std::isinf(ExpectedView(behind).worst_sigma(kAbove)));
  World far = bare_seabed();
  add_box(far, {1.0, 1.0, 20.0}, {12.0, 0.0, -5.0});
  EXPECT_TRUE(std::isinf(ExpectedView(far).worst_sigma(kAbove)));
  World hidden = bare_seabed();
  add_box(hidden, {0.2, 200.0, 20.0}, {3.0, 0.0, -5.0});
  const double wall_only = ExpectedView(hidden).worst_sigma(kAbove);
  add_box(hidden, {1.0, 1.0, 20.0}, {6.0, 1.0, -5.0});
  EXPECT_EQ(ExpectedView(hidden).worst_sigma(kAbove), wall_only);
}

// By the covariance of position and heading, the heading known to 2 degrees.
double worst_sigma(Eigen::Matrix3d information) {
  information(2, 2) += std::pow(deg_to_rad(2.0), -2);
  Eigen::FullPivLU<Eigen::Matrix3d> solver(information);
  if (!solver.isInvertible()) return std::numeric_limits<double>::infinity();
  const Eigen::Matrix2d covariance = solver.inverse().topLeftCorner<2, 2>();
  const double half_trace = 0.5 * covariance.trace();
  return std::sqrt(half_trace +
                   std::sqrt(std::max(half_trace * half_trace - covariance.determinant(), 0.0)));
}

// The ranges of the simulated camera come from another tracer.
TEST(ExpectedView, SeesWhatTheSimulatedRangeCameraSees) {
  Diagnostics diagnostics;
  const std::string path = fmt::format("{}/missions/maps/cluttered.sdf", DIVE_SOURCE_DIR);
  const auto text = read_source_text(path, 1U << 20U);
  ASSERT_TRUE(text);
  MeshFiles meshes(path, Resources::kInFolder, {}, MeshFiles::Keep::kNothing);
  const auto world = parse_sdf(*text, diagnostics, meshes);
  ASSERT_TRUE(world);
  vehicle::RangeCameraOptions exact;
  exact.width = 24;
  exact.height = 18;
  exact.noise_m = exact.noise_share = exact.dropout_share = exact.particles_per_m3 = 0.0;
  vehicle::RangeCamera camera(*world, exact, 1);
  const MapMatcher matcher(*world);
  const ExpectedView view(*world);
  Random random(70421, 1);
  int compared = 0;
  for (int i = 0; i < 200; ++i) {
    const Pose X_WB = {
        {random.uniform(0.0, 30.0), random.uniform(-4.0, 4.0), random.uniform(-5.0, -1.0)},
        from_rpy(0.0, 0.0, random.uniform(-M_PI, M_PI))};
    const Eigen::Matrix3d information = matcher.expected_information(camera.take(0, X_WB), X_WB);
    const double seen = worst_sigma(information);
    const double expected = view.worst_sigma(X_WB);
    if (!(seen < 0.2)) {
      EXPECT_GT(expected, 0.1) << X_WB.p.transpose();
      continue;
    }
    ++compared;
    EXPECT_NEAR(expected, seen, 0.2 * seen) << X_WB.p.transpose();
  }
  EXPECT_GT(compared, 50);
}

}  // namespace
}  // namespace dive::planning
