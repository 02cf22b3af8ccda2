#include "estimation/visual_inertial/loop_closure/relative_pose.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "test/estimation/visual_inertial/loop_closure/marked_world.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using dive::testing::MarkedWorld;
using testing::PaintedRoom;

constexpr int kMostBits = 60;

Pose X_RL() { return MarkedWorld::camera(1).X_BC.inverse() * MarkedWorld::camera(0).X_BC; }

RelativePoseOptions options() {
  RelativePoseOptions result;
  result.cameras = {MarkedWorld::camera(0), MarkedWorld::camera(1)};
  result.pixels_then = result.pixels_now = 0.7;
  return result;
}

struct Two {
  KeyframeView then;
  KeyframeView now;
  Pose X_C0C1;

  [[nodiscard]] std::optional<RelativePose> solve(RelativePoseOptions with = options()) const {
    return relative_pose(then, now, match(then, now, kMostBits), X_RL(), with);
  }
};

Two two_views(const MarkedWorld& world, Random& random) {
  const Pose X_0{{0.1, 0.2, 0}, from_rpy(0.1, 0.05, 0.1)};
  const Pose between{{0.4, -0.3, 0.1}, from_rpy(-0.1, 0.1, 0.2)};
  const Pose X_BC = MarkedWorld::camera(0).X_BC;
  return {world.view(0, X_0, random), world.view(1, X_0 * between, random),
          X_BC.inverse() * between * X_BC};
}

TEST(RelativePose, ItsErrorIsAsLargeAsItsCovariance) {
  Random random(1);
  double nees = 0.0;
  constexpr int kRuns = 100;
  for (int i = 0; i < kRuns; ++i) {
    MarkedWorld world;
    world.add(120, {1.5, -3, -2}, {5, 3, 2}, random);
    const Two two = two_views(world, random);
    const auto found = two.solve();
    ASSERT_TRUE(found) << match(two.then, two.now, kMostBits).size();
    EXPECT_GT(found->points, 50);
    Vector6d error;
    error << two.X_C0C1.p - found->X_C0C1.p, so3_log(found->X_C0C1.q.conjugate() * two.X_C0C1.q);
    EXPECT_LT(error.head<3>().norm(), 0.03);
    nees += error.dot(found->covariance.llt().solve(error)) / kRuns;
  }
  EXPECT_GT(nees, 5.0);  // expected 6; the mean over 100 is within 0.7
  EXPECT_LT(nees, 7.5);  // outlier rejection truncates the tails
}

TEST(RelativePose, WrongMatchesAreLeftOut) {
  Random random(2);
  MarkedWorld world;
  world.add(150, {1.5, -3, -2}, {5, 3, 2}, random);
  const Two two = two_views(world, random);
  auto matches = match(two.then, two.now, kMostBits);
  for (std::size_t i = 0; i + 1 < matches.size(); i += 3) {
    std::swap(matches[i].second, matches[i + 1].second);
  }
  RelativePoseOptions with = options();
  with.min_share = 0.2;
  const auto found = relative_pose(two.then, two.now, matches, X_RL(), with);
  ASSERT_TRUE(found);
  EXPECT_LT((found->X_C0C1.p - two.X_C0C1.p).norm(), 0.05);
  EXPECT_LT(found->points, static_cast<int>(0.45 * static_cast<double>(matches.size())));
  with.min_share = 0.5;
  EXPECT_FALSE(relative_pose(two.then, two.now, matches, X_RL(), with));
}

TEST(RelativePose, NothingFromFewPointsOrFromOneCornerOrWithoutStereo) {
  Random random(3);
  MarkedWorld few;
  few.add(20, {1.5, -3, -2}, {5, 3, 2}, random);
  EXPECT_FALSE(two_views(few, random).solve());
  MarkedWorld corner;
  corner.add(100, {4, 0.5, 0.5}, {5, 1.5, 1.5}, random);
  EXPECT_FALSE(two_views(corner, random).solve());
  MarkedWorld many;
  many.add(150, {1.5, -3, -2}, {5, 3, 2}, random);
  Two mono = two_views(many, random);
  EXPECT_TRUE(mono.solve());
  for (KeyframePoint& point : mono.then.points) point.right.reset();
  EXPECT_FALSE(mono.solve());
  EXPECT_FALSE(relative_pose({}, {}, {}, X_RL(), options()));
}

TEST(RelativePose, NothingFromPlacesThatAreNotTheSame) {
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    MarkedWorld here;
    here.add(150, {1.5, -3, -2}, {5, 3, 2}, random);
    MarkedWorld there;
    there.add(150, {1.5, -3, -2}, {5, 3, 2}, random);
    Two two = two_views(here, random);
    two.now = two_views(there, random).now;
    EXPECT_FALSE(two.solve());
    // Even if every point has a match.
    std::vector<std::pair<std::size_t, std::size_t>> all;
    for (std::size_t k = 0; k < std::min(two.then.points.size(), two.now.points.size()); ++k) {
      all.emplace_back(k, k);
    }
    EXPECT_FALSE(relative_pose(two.then, two.now, all, X_RL(), options()));
  }
}

// --- with images ---

struct Cameras {
  CameraModel left = testing::test_camera(0.06);
  CameraModel right = testing::test_camera(-0.06);
  KeyframeExtractor viewer{{}, left, right};

  KeyframeView view(PaintedRoom& room, const Pose& X_WB, Utime utime) {
    return *viewer.view(room.image(left, X_WB * left.X_BC, utime),
                        room.image(right, X_WB * right.X_BC, utime));
  }
  [[nodiscard]] std::optional<RelativePose> solve(const KeyframeView& then,
                                                  const KeyframeView& now) const {
    RelativePoseOptions with;
    with.cameras = {left, right};
    return relative_pose(then, now, match(then, now, kMostBits), right.X_BC.inverse() * left.X_BC,
                         with);
  }
};

const Pose kThen{{0.5, -0.3, 0.2}, from_rpy(0.1, 0.2, 0.4)};

TEST(KeyframeExtractor, APlaceIsFoundAgainInImages) {
  PaintedRoom room({4, 3, 2});
  room.snow(60, kThen.p, 2.0, 0.2);
  Cameras cameras;
  const Pose between{{0.25, 0.1, -0.05}, from_rpy(0.05, -0.03, 0.08)};
  const KeyframeView then = cameras.view(room, kThen, 0);
  EXPECT_GT(then.points.size(), 250U);
  EXPECT_GT(likeness(then, then, 80, kMostBits), 79);
  const KeyframeView now = cameras.view(room, kThen * between, 60'000'000);
  const auto found = cameras.solve(then, now);
  ASSERT_TRUE(found);
  const Pose X_B0B1 = cameras.left.X_BC * found->X_C0C1 * cameras.left.X_BC.inverse();
  EXPECT_LT((X_B0B1.p - between.p).norm(), 0.02);
  EXPECT_LT(rad_to_deg(angle_between(X_B0B1.q, between.q)), 0.3);
}

TEST(KeyframeExtractor, OtherWallsOfTheSamePaintAreNotThatPlace) {
  PaintedRoom room({4, 3, 2});
  PaintedRoom other({4, 3, 2}, 7);
  Cameras cameras;
  const KeyframeView then = cameras.view(room, kThen, 0);
  for (const double heading : {1.5, 3.0, 4.5}) {
    const Pose turned{kThen.p, from_rpy(0, 0, heading)};
    EXPECT_FALSE(cameras.solve(then, cameras.view(room, turned, 1)));
  }
  EXPECT_FALSE(cameras.solve(then, cameras.view(other, kThen, 1)));
}

TEST(KeyframeExtractor, ImagesNotAsAgreedAreRefusedAndEmptyOnesGiveNothing) {
  PaintedRoom room({4, 3, 2});
  Cameras cameras;
  const ImageFrame good = room.image(cameras.left, kThen * cameras.left.X_BC, 0);
  ImageFrame cut = good;
  cut.pixels.pop_back();
  EXPECT_FALSE(cameras.viewer.view(cut, good));
  ImageFrame colour = good;
  colour.format = ImageFrame::Format::kRgb8;
  EXPECT_FALSE(cameras.viewer.view(good, colour));
  ImageFrame black = good;
  std::fill(black.pixels.begin(), black.pixels.end(), std::uint8_t{0});
  const auto nothing = cameras.viewer.view(black, black);
  ASSERT_TRUE(nothing);
  EXPECT_TRUE(nothing->points.empty());
  EXPECT_EQ(KeyframeExtractorOptions{}.validate(), "");
  EXPECT_NE(KeyframeExtractorOptions{.max_points = 1}.validate().find("max_points"),
            std::string::npos);
}

}  // namespace
}  // namespace dive::estimation
