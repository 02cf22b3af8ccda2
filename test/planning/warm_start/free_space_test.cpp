#include "planning/warm_start/free_space.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "test/planning/reference.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::arbitrary_double;
using testing::arbitrary_vector;
using testing::draw;
using testing::still;

World arbitrary_balls() {
  World world;
  const int count = draw(rc::gen::inRange(0, 8));
  for (int i = 0; i < count; ++i) {
    world.obstacles.push_back(
        {"ball", Sphere{draw(arbitrary_double(0.2, 1.5))}, still(draw(arbitrary_vector(4.0)))});
  }
  return world;
}

// Least slack along the motion, sampled at millimetres, from the definition.
double sampled_slack(const World& world, double radius, const VirtualObstacle& ball,
                     const Vector3d& from, const Vector3d& to) {
  double least = 1e300;
  const int count = static_cast<int>((to - from).norm() / 0.001) + 1;
  for (int i = 0; i <= count; ++i) {
    const Vector3d p = from + (to - from) * i / count;
    for (const Obstacle& o : world.obstacles) {
      least = std::min(least, (p - o.X_WO.p).norm() - std::get<Sphere>(o.shape).radius - radius);
    }
    least = std::min(least, (p - ball.centre_W).norm() - ball.radius);
  }
  return least;
}

TEST(FreeSpace, AMotionIsFreeWhenEveryPositionOnItIs) {
  int free = 0;
  int blocked = 0;
  EXPECT_TRUE(rc::check([&] {
    const World world = arbitrary_balls();
    const double radius = draw(arbitrary_double(0.0, 0.5));
    const VirtualObstacle ball{draw(arbitrary_vector(4.0)), draw(arbitrary_double(0.0, 1.5))};
    const Vector3d from = draw(arbitrary_vector(5.0));
    const Vector3d to = draw(arbitrary_vector(5.0));
    const Scene scene(world);
    const bool answer = FreeSpace(scene, radius, {ball}).is_free(from, to);
    const double truth = sampled_slack(world, radius, ball, from, to);
    if (answer) RC_ASSERT(truth >= -FreeSpace::kStep / 2.0 - 1e-9);
    if (!answer) RC_ASSERT(truth < 0.001);
    ++(answer ? free : blocked);
  }));
  EXPECT_GT(free, 5);
  EXPECT_GT(blocked, 5);
}

TEST(Shorten, KeepsTheEndsAndTheFreedomAndNeverLengthens) {
  int paths = 0;
  const auto length = [](const std::vector<Vector3d>& path) {
    double sum = 0.0;
    for (std::size_t i = 1; i < path.size(); ++i) sum += (path[i] - path[i - 1]).norm();
    return sum;
  };
  EXPECT_TRUE(rc::check([&] {
    const World world = arbitrary_balls();
    const Scene scene(world);
    const FreeSpace space(scene, 0.2, {});
    std::vector<Vector3d> path;
    for (int i = 0; i < 12; ++i) {
      const Vector3d p = draw(arbitrary_vector(5.0));
      if (space.slack(p) >= 0.0 && (path.empty() || space.is_free(path.back(), p))) {
        path.push_back(p);
      }
    }
    if (path.size() < 2) return;
    ++paths;
    const auto shorter = shorten(space, path, 0.5);
    RC_ASSERT(shorter.front() == path.front());
    RC_ASSERT(shorter.back() == path.back());
    RC_ASSERT(length(shorter) <= length(path) + 1e-9);
    const VirtualObstacle nothing{{100, 0, 0}, 0.0};
    for (std::size_t i = 1; i < shorter.size(); ++i) {
      RC_ASSERT(sampled_slack(world, 0.2, nothing, shorter[i - 1], shorter[i]) >=
                -FreeSpace::kStep);
    }
  }));
  EXPECT_GT(paths, 50);
}

TEST(Shorten, CutsADetourThatNothingAsksFor) {
  const Scene scene(World{});
  const auto path = shorten(FreeSpace(scene, 0.2, {}), {{0, 0, 0}, {1, 5, 0}, {4, 0, 0}}, 0.5);
  ASSERT_EQ(path.size(), 2U);
  EXPECT_EQ(path[1], Vector3d(4, 0, 0));
}

TEST(Resample, KeepsCornersAndTheSpacing) {
  const std::vector<Vector3d> path{{0, 0, 0}, {3, 0, 0}, {3, 1, 0}};
  const auto fine = resample(path, 1.5);
  ASSERT_EQ(fine.size(), 4U);
  EXPECT_EQ(fine[1], Vector3d(1.5, 0, 0));
  EXPECT_EQ(fine[2], path[1]);
  EXPECT_EQ(fine[3], path[2]);
  EXPECT_EQ(resample(path, 1.4).size(), 5U);
}

}  // namespace
}  // namespace dive::planning
