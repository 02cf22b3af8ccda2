#include "estimation/visual_inertial/front_end/epipolar.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/se3.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFocal = 450.0;    // px, of a pinhole
constexpr double kTolerance = 1.0;  // px

// Random points in front of a camera that moves by `t`; those that move by themselves last.
std::vector<TurnedMatch> matches_of(const Vector3d& t, int standing, int moving, double noise_px,
                                    Random& random) {
  const double noise = noise_px / kFocal;
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
    matches.push_back({before, now, kFocal * Eigen::Matrix2d::Identity()});
  }
  return matches;
}

RC_GTEST_PROP(Epipolar, KeepsWhatStandsStillAndFewOfThoseThatMove, ()) {
  Random random(*rc::gen::arbitrary<std::uint64_t>());
  const Vector3d direction(random.normal(), random.normal(), random.normal());
  const auto matches =
      matches_of(random.uniform(0.1, 0.3) * direction.normalized(), 80, 80, 0.2, random);
  const auto agrees = agree_with_one_translation(matches, kTolerance, random);
  const auto first_moving = agrees.begin() + 80;
  RC_ASSERT(std::count(agrees.begin(), first_moving, true) >= 76);
  // Motion along a point's own epipolar line is undetectable.
  RC_ASSERT(std::count(first_moving, agrees.end(), true) <= 24);
}

// Through an equidistant lens, 70 degrees off its axis, a pixel is 8 times as much of n along the
// radius as on the axis, and 3 times as much across.
TEST(Epipolar, CountsInPixelsFarOffTheAxis) {
  constexpr double kPerRadian = 360.0;
  Random random(6);
  const auto through_lens = [&](const Vector3d& p, double noise_px) {
    const double theta = std::atan2(p.head<2>().norm(), p.z());
    const Vector2d noise(random.normal(), random.normal());
    const Vector2d pixel = kPerRadian * theta * p.head<2>().normalized() + noise_px * noise;
    return Vector2d(std::tan(pixel.norm() / kPerRadian) * pixel.normalized());
  };
  const auto jacobian = [&](const Vector2d& n) {
    const double r = n.norm();
    const Vector2d along = n / r;
    const Vector2d across(-along.y(), along.x());
    return Eigen::Matrix2d(kPerRadian / (1.0 + r * r) * along * along.transpose() +
                           kPerRadian * std::atan(r) / r * across * across.transpose());
  };
  std::vector<TurnedMatch> matches;
  for (int i = 0; i < 200; ++i) {
    const double theta = random.uniform(1.0, 1.25);
    const double turn = random.uniform(0.0, 6.28);
    const Vector3d p =
        random.uniform(1.0, 3.0) * Vector3d(std::sin(theta) * std::cos(turn),
                                            std::sin(theta) * std::sin(turn), std::cos(theta));
    Vector3d after = p + Vector3d(0.08, 0.02, -0.05);
    // Of the last 80, each drifts by about 7 pixels in some direction.
    const Vector3d drift(random.normal(), random.normal(), random.normal());
    if (i >= 120) after += 0.02 * p.norm() * drift.normalized();
    const Vector2d now = through_lens(after, 0.2);
    matches.push_back({through_lens(p, 0.2).homogeneous(), now, jacobian(now)});
  }
  const auto agrees = agree_with_one_translation(matches, kTolerance, random);
  EXPECT_GE(std::count(agrees.begin(), agrees.begin() + 120, true), 114);
  EXPECT_LE(std::count(agrees.begin() + 120, agrees.end(), true), 28);
}

TEST(Epipolar, KeepsAllWhereNothingHasMoved) {
  Random random(3);
  const auto agrees = agree_with_one_translation(matches_of(Vector3d::Zero(), 50, 0, 0.2, random),
                                                 kTolerance, random);
  EXPECT_EQ(std::count(agrees.begin(), agrees.end(), true), 50);
}

TEST(Epipolar, RequiresPositiveDepth) {
  Random random(4);
  std::vector<TurnedMatch> matches = matches_of({0.2, 0.0, 0.0}, 40, 0, 0.0, random);
  // On its epipolar line, but in the opposite direction.
  matches.push_back({{0.1, 0.1, 1.0}, {0.05, 0.1}, kFocal * Eigen::Matrix2d::Identity()});
  const auto agrees = agree_with_one_translation(matches, kTolerance, random);
  EXPECT_EQ(std::count(agrees.begin(), agrees.end(), true), 40);
  EXPECT_FALSE(agrees.back());
}

TEST(Epipolar, RejectsNothingWithFewMatches) {
  Random random(5);
  EXPECT_TRUE(agree_with_one_translation({}, kTolerance, random).empty());
  const auto agrees = agree_with_one_translation(matches_of({0.2, 0.0, 0.0}, 0, 6, 0.0, random),
                                                 kTolerance, random);
  EXPECT_EQ(std::count(agrees.begin(), agrees.end(), true), 6);
}

}  // namespace
}  // namespace dive::estimation
