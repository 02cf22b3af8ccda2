#include "estimation/visual_inertial/tags/tag_detector.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "common/random.h"
#include "test/estimation/visual_inertial/tags/tag_print.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using testing::blur;
using testing::image_of;
using testing::Print;
using testing::tag_camera;
using testing::true_corners;

TagDetector detector() { return {tag_camera(), {}}; }

Print leaning(Random& random, int id) {
  Print print;
  print.id = id;
  print.X_CT.p = {random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3), random.uniform(0.7, 1.5)};
  print.X_CT.q =
      from_rpy(random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), random.uniform(-3.1, 3.1));
  return print;
}

TEST(TagDetector, FindsCornersWithoutBias) {
  Random random(7);
  TagDetector finder = detector();
  Vector2d mean = Vector2d::Zero();
  double square = 0.0;
  int corners = 0;
  int found = 0;
  constexpr int kImages = 40;
  for (int i = 0; i < kImages; ++i) {
    const Print print = leaning(random, (37 * i) % 587);
    const auto detected = finder.find(image_of({print}, 2.0, static_cast<std::uint64_t>(i)));
    if (detected.empty()) continue;
    ++found;
    ASSERT_EQ(detected.size(), 1U);
    EXPECT_EQ(detected[0].id, print.id);
    for (std::size_t k = 0; k < 4; ++k) {
      const Vector2d pixel = 240.0 * detected[0].corners[k] + Vector2d(239.5, 159.5);
      const Vector2d off = pixel - true_corners(print)[k];
      mean += off;
      square += off.squaredNorm();
      ++corners;
    }
    const std::vector<TagPose> poses = tag_poses(detected[0], print.size_m);
    const auto is_true = [&](const TagPose& pose) {
      return angle_between(pose.X_CT.q, print.X_CT.q) < 0.15 &&
             (pose.X_CT.p - print.X_CT.p).norm() < 0.03;
    };
    EXPECT_TRUE(std::any_of(poses.begin(), poses.end(), is_true)) << i;
  }
  EXPECT_GE(found, kImages * 9 / 10);
  EXPECT_LT((mean / corners).norm(), 0.05) << (mean / corners).transpose();
  EXPECT_LT(std::sqrt(square / (2 * corners)), 0.25);
}

TEST(TagDetector, LeavesOutWhatCannotBeRead) {
  TagDetector finder = detector();
  const Print print{5, 0.2, {{0.05, 0.02, 1.0}, from_rpy(0.2, 0.3, 0.1)}};
  ASSERT_EQ(finder.find(image_of({print}, 2.0)).size(), 1U);

  ImageFrame hidden = image_of({print}, 2.0);
  const int left = static_cast<int>(true_corners(print)[0].x());
  for (int v = 0; v < hidden.height; ++v) {
    for (int u = left - 20; u < left + 16; ++u) {
      hidden.pixels[static_cast<std::size_t>(v * hidden.width + u)] = 90;
    }
  }
  EXPECT_TRUE(finder.find(hidden).empty()) << "a third of it is hidden";
  ImageFrame unsharp = image_of({print}, 2.0);
  blur(unsharp, 15);
  EXPECT_TRUE(finder.find(unsharp).empty()) << "blurred";
  Print tiny = print;
  tiny.size_m = 0.04;
  EXPECT_TRUE(finder.find(image_of({tiny}, 2.0)).empty()) << "ten pixels wide";
  EXPECT_TRUE(finder.find(image_of({}, 40.0)).empty()) << "noise";
  ImageFrame other = image_of({print}, 2.0);
  other.width = 320;
  EXPECT_TRUE(finder.find(other).empty()) << "not an image of this camera";
}

TEST(TagDetector, ReportsBothOfTwoThatAreAlike) {
  const Print one{5, 0.2, {{-0.4, 0.0, 1.0}, Eigen::Quaterniond::Identity()}};
  const Print other{5, 0.2, {{0.4, 0.0, 1.0}, Eigen::Quaterniond::Identity()}};
  TagDetector finder = detector();
  const auto detected = finder.find(image_of({one, other}, 2.0));
  ASSERT_EQ(detected.size(), 2U);
  EXPECT_EQ(detected[0].id, 5);
  EXPECT_EQ(detected[1].id, 5);
}

}  // namespace
}  // namespace dive::estimation
