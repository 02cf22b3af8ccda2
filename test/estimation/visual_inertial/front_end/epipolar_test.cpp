#include "estimation/visual_inertial/front_end/epipolar.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/se3.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPixel = 1.0 / 450.0;

// Random points in front of a camera that moves by `t`; those that move by themselves last.
std::vector<TurnedMatch> matches_of(const Vector3d& t, int standing, int moving, double noise,
                                    Random& random) {
  std::vector<TurnedMatch> matches;
  for (int i = 0; i < standing + moving; ++i) {
    const double z = random.uniform(1.0, 5.0);
    Vector3d p(z * random.uniform(-0.7, 0.7), z * random.uniform(-0.5, 0.5), z);
    const Vector3d before = p / z + noise * Vector3d(random.normal(), random.normal(), 0.0);
    p += t;
    if (i >= standing) {
      const Vector3d drift(random.normal(), random.normal(), random.normal());
      p += 0.06 * z * drift.normalized();
    }
    const Vector2d now = p.head<2>() / p.z() + noise * Vector2d(random.normal(), random.normal());
    matches.push_back({before, now});
  }
  return matches;
}

RC_GTEST_PROP(Epipolar, KeepsWhatStandsStillAndFewOfThoseThatMove, ()) {
  Random random(*rc::gen::arbitrary<std::uint64_t>());
  const Vector3d direction(random.normal(), random.normal(), random.normal());
  const auto matches =
      matches_of(random.uniform(0.1, 0.3) * direction.normalized(), 80, 80, 0.2 * kPixel, random);
  const auto agrees = agree_with_one_translation(matches, kPixel, random);
  const auto first_moving = agrees.begin() + 80;
  RC_ASSERT(std::count(agrees.begin(), first_moving, true) >= 76);
  // Motion along a point's own epipolar line is undetectable.
  RC_ASSERT(std::count(first_moving, agrees.end(), true) <= 24);
}

TEST(Epipolar, KeepsAllWhereNothingHasMoved) {
  Random random(3);
  const auto agrees = agree_with_one_translation(
      matches_of(Vector3d::Zero(), 50, 0, 0.2 * kPixel, random), kPixel, random);
  EXPECT_EQ(std::count(agrees.begin(), agrees.end(), true), 50);
}

TEST(Epipolar, RequiresPositiveDepth) {
  Random random(4);
  std::vector<TurnedMatch> matches = matches_of({0.2, 0.0, 0.0}, 40, 0, 0.0, random);
  // On its epipolar line, but in the opposite direction.
  matches.push_back({{0.1, 0.1, 1.0}, {0.05, 0.1}});
  const auto agrees = agree_with_one_translation(matches, kPixel, random);
  EXPECT_EQ(std::count(agrees.begin(), agrees.end(), true), 40);
  EXPECT_FALSE(agrees.back());
}

TEST(Epipolar, RejectsNothingWithFewMatches) {
  Random random(5);
  EXPECT_TRUE(agree_with_one_translation({}, kPixel, random).empty());
  const auto agrees =
      agree_with_one_translation(matches_of({0.2, 0.0, 0.0}, 0, 6, 0.0, random), kPixel, random);
  EXPECT_EQ(std::count(agrees.begin(), agrees.end(), true), 6);
}

}  // namespace
}  // namespace dive::estimation
