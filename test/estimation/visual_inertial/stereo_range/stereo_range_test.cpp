#include "estimation/visual_inertial/stereo_range/stereo_range.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "estimation/visual_inertial/stereo_range/disparity.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;
using testing::PaintedRoom;
using testing::test_camera;

struct Eyes {
  CameraModel left = test_camera(0.06);
  CameraModel right = test_camera(-0.06);

  // Not exactly parallel, as in any real pair.
  Eyes() { right.X_BC.q = right.X_BC.q * so3_exp({0.01, -0.02, 0.015}); }

  [[nodiscard]] StereoRange ranges(const StereoRangeOptions& options = {}) const {
    return *StereoRange::create(options, left, right);
  }
};

struct Verdict {
  int told = 0;
  int beyond = 0;
  int in_1 = 0;
  int in_3 = 0;
  int nearer = 0;  // nearer than the truth by a tenth
  double worst_sigma = 0.0;
  [[nodiscard]] double share(int part) const {
    return static_cast<double>(part) / std::max(1, told);
  }
};

// Compares the ranges with the walls along their rays.
Verdict judge(const StereoScan& seen, const PaintedRoom& room, const Pose& X_WB) {
  Verdict verdict{seen.told, seen.beyond};
  const Vector3d eye_W = X_WB * seen.scan.origin_B.cast<double>();
  for (std::size_t i = 0; i < seen.scan.points_B.size(); ++i) {
    if (!std::isfinite(seen.sigma_m[i])) continue;
    const Vector3d ray_W = X_WB * seen.scan.points_B[i].cast<double>() - eye_W;
    const Pose X_WRay{eye_W, Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), ray_W)};
    const double truth = (room.wall_at(X_WRay, Eigen::Vector2d::Zero()) - eye_W).norm();
    const double error = ray_W.norm() - truth;
    verdict.in_1 += std::abs(error) < seen.sigma_m[i] ? 1 : 0;
    verdict.in_3 += std::abs(error) < 3.0 * seen.sigma_m[i] ? 1 : 0;
    verdict.nearer += error < -0.1 * truth ? 1 : 0;
    verdict.worst_sigma = std::max(verdict.worst_sigma, seen.sigma_m[i] / ray_W.squaredNorm());
  }
  return verdict;
}

const Pose kHere{{0.5, -0.3, 0.2}, from_rpy(0.1, 0.2, 0.4)};

StereoScan look(PaintedRoom& room, const Eyes& eyes, StereoRange& ranges, double noise = 1.0,
                double light = 1.0) {
  return *ranges.look(room.picture(eyes.left, kHere * eyes.left.X_BC, 1000, noise, light),
                      room.picture(eyes.right, kHere * eyes.right.X_BC, 1000, noise, light));
}

TEST(StereoRange, ErrorsAreAsLargeAsItsSigmas) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const StereoScan seen = look(room, eyes, ranges);
  const Verdict verdict = judge(seen, room, kHere);
  EXPECT_EQ(seen.scan.points_B.size(), 7500U);
  EXPECT_EQ(seen.scan.utime, 1000);
  EXPECT_LT((seen.scan.origin_B - Eigen::Vector3f(0.0F, 0.06F, 0.0F)).norm(), 1e-6F);
  EXPECT_GT(verdict.told, 3000);
  EXPECT_GT(verdict.share(verdict.in_1), 0.60);
  EXPECT_GT(verdict.share(verdict.in_3), 0.985);
  EXPECT_LT(verdict.share(verdict.nearer), 0.002);
  EXPECT_LE(verdict.worst_sigma, ranges.noise_square() * 1.001);
  EXPECT_GT(ranges.reach(), 4.0);
}

TEST(StereoRange, FlakesThatDriftStayRare) {
  PaintedRoom room({4, 3, 2});
  room.snow(300, kHere.p, 2.0, 0.1);
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const Verdict verdict = judge(look(room, eyes, ranges), room, kHere);
  EXPECT_GT(verdict.told, 2000);
  EXPECT_LT(verdict.share(verdict.nearer), 0.005);
}

TEST(StereoRange, LittleLightTellsLessAndNothingWrong) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const Verdict verdict = judge(look(room, eyes, ranges, 2.0, 0.2), room, kHere);
  EXPECT_GT(verdict.told, 100);
  EXPECT_GT(verdict.share(verdict.in_3), 0.97);
  EXPECT_LT(verdict.share(verdict.nearer), 0.005);
}

TEST(StereoRange, NothingIsToldOfNoise) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  for (const double noise : {0.0, 1.0, 3.0, 10.0}) {
    ImageFrame left = room.picture(eyes.left, {}, 0, noise, 0.0);
    ImageFrame right = room.picture(eyes.right, {}, 0, noise, 0.0);
    // Noise around a grey that increases to one side, as in water.
    for (int i = 0; i < left.width * left.height; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const int grey = 60 + (i % left.width) / 16;
      left.pixels[k] = static_cast<std::uint8_t>(grey + left.pixels[k]);
      right.pixels[k] = static_cast<std::uint8_t>(grey + right.pixels[k]);
    }
    const StereoScan seen = *ranges.look(left, right);
    EXPECT_LE(seen.told + seen.beyond, 4) << "noise " << noise;
  }
}

TEST(StereoRange, WhatIsFarIsBeyondOrNotToldButNeverNear) {
  PaintedRoom room({60, 60, 60});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const StereoScan seen = look(room, eyes, ranges);
  EXPECT_LE(seen.told, 15);
  for (std::size_t i = 0; i < seen.sigma_m.size(); ++i) {
    if (!std::isinf(seen.sigma_m[i])) continue;
    EXPECT_GT((seen.scan.points_B[i] - seen.scan.origin_B).norm(), seen.scan.reach);
  }
}

TEST(StereoRange, SamePicturesSameScan) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  const ImageFrame left = room.picture(eyes.left, kHere * eyes.left.X_BC, 0);
  const ImageFrame right = room.picture(eyes.right, kHere * eyes.right.X_BC, 0);
  StereoRange one = eyes.ranges();
  StereoRange other = eyes.ranges();
  (void)other.look(right, left);  // the previous pair must not affect the result
  const StereoScan a = *one.look(left, right);
  const StereoScan b = *other.look(left, right);
  ASSERT_EQ(a.told, b.told);
  for (std::size_t i = 0; i < a.sigma_m.size(); ++i) {
    if (!std::isfinite(a.sigma_m[i])) continue;
    EXPECT_EQ(a.scan.points_B[i], b.scan.points_B[i]);
  }
}

TEST(StereoRange, PicturesThatAreNoPairAreRefused) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const ImageFrame good = room.picture(eyes.left, kHere * eyes.left.X_BC, 0);
  ImageFrame late = good;
  late.utime = 2000;
  EXPECT_FALSE(ranges.look(good, late));
  ImageFrame colour = good;
  colour.format = ImageFrame::Format::kRgb8;
  EXPECT_FALSE(ranges.look(colour, good));
  ImageFrame cut = good;
  cut.pixels.pop_back();
  EXPECT_FALSE(ranges.look(good, cut));
  ImageFrame narrow = good;
  narrow.width /= 2;
  EXPECT_FALSE(ranges.look(narrow, good));
}

TEST(StereoRange, CamerasThatAreNoPairAreRefused) {
  const Eyes eyes;
  const auto is_made = [](const CameraModel& left, const CameraModel& right) {
    return StereoRange::create({}, left, right).has_value();
  };
  EXPECT_TRUE(is_made(eyes.left, eyes.right));
  EXPECT_FALSE(is_made(eyes.right, eyes.left));
  EXPECT_FALSE(is_made(eyes.left, eyes.left));
  CameraModel turned = eyes.right;
  turned.X_BC.q = turned.X_BC.q * so3_exp({0.0, 1.2, 0.0});
  EXPECT_FALSE(is_made(eyes.left, turned));
  CameraModel small = eyes.right;
  small.width = 376;
  EXPECT_FALSE(is_made(eyes.left, small));
  CameraModel broken = eyes.right;
  broken.fx = 0.0;
  EXPECT_FALSE(is_made(eyes.left, broken));
}

TEST(StereoRange, KnowsWhenTheCamerasAreOthers) {
  const Eyes eyes;
  const StereoRange ranges = eyes.ranges();
  EXPECT_TRUE(ranges.fits(eyes.left, eyes.right));
  CameraModel turned = eyes.right;
  turned.X_BC.q = turned.X_BC.q * so3_exp({0.0, deg_to_rad(0.05), 0.0});
  EXPECT_FALSE(ranges.fits(eyes.left, turned));
  // Both cameras together: the pair is the same, but its points move in the body.
  CameraModel left = eyes.left;
  CameraModel right = eyes.right;
  const Eigen::Quaterniond turn = so3_exp({0.0, 0.01, 0.0});
  for (CameraModel* camera : {&left, &right}) camera->X_BC = Pose{{}, turn} * camera->X_BC;
  EXPECT_FALSE(ranges.fits(left, right));
}

TEST(StereoRange, OptionsOutOfRangeAreNamed) {
  StereoRangeOptions options;
  EXPECT_EQ(options.validate(), "");
  options.columns = 0;
  EXPECT_NE(options.validate().find("columns"), std::string::npos);
  options = {};
  options.most_sigma_px = 0.05;  // below the calibration's
  EXPECT_NE(options.validate().find("most_sigma_px"), std::string::npos);
}

// Rows of a smooth random function, the right ones shifted by 7.3 pixels.
TEST(Disparity, IsFoundToAFractionOfAPixelAndNotInNoise) {
  constexpr int kWidth = 96;
  constexpr int kHeight = 32;
  Random random(3);
  std::vector<double> phases;
  for (int i = 0; i < 4 * kHeight; ++i) phases.push_back(random.uniform(0.0, 6.28));
  const auto paint = [&](double shift, double contrast, double noise) {
    std::vector<std::uint8_t> pixels;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        double value = 128.0 + noise * random.normal();
        for (int k = 0; k < 4; ++k) {
          value += contrast * std::sin((u + shift) * 0.2 * (k + 1) +
                                       phases[static_cast<std::size_t>(4 * v + k)]);
        }
        pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L)));
      }
    }
    return pixels;
  };
  int within = 0;
  int found_in_noise = 0;
  for (int i = 0; i < 100; ++i) {
    const auto left = paint(0.0, 10.0, 2.0);
    const auto right = paint(7.3, 10.0, 2.0);
    const GrayView l{left.data(), kWidth, kHeight};
    const GrayView r{right.data(), kWidth, kHeight};
    const auto found = refine_disparity(l, r, 50, 15, 6.8);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->px, 7.3, 0.25);
    within += std::abs(found->px - 7.3) < 2.0 * found->sigma_px ? 1 : 0;
    EXPECT_FALSE(refine_disparity(l, r, 5, 15, 6.8));    // the window leaves the left image
    EXPECT_FALSE(refine_disparity(l, r, 50, 30, 6.8));   // the window leaves it below
    EXPECT_FALSE(refine_disparity(l, r, 12, 15, 6.8));   // its match leaves the right one
    EXPECT_FALSE(refine_disparity(l, r, 50, 15, 14.0));  // too far from the start
    const auto noise = paint(0.0, 0.0, 3.0);
    const auto other = paint(0.0, 0.0, 3.0);
    if (refine_disparity({noise.data(), kWidth, kHeight}, {other.data(), kWidth, kHeight}, 50, 15,
                         3.0)) {
      ++found_in_noise;
    }
  }
  EXPECT_GE(within, 80);
  EXPECT_LE(found_in_noise, 2);
}

}  // namespace
}  // namespace dive::estimation
