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
  CameraModel left;
  CameraModel right;

  // Not exactly parallel, as in any real pair.
  explicit Eyes(const CameraModel& one = test_camera(0.06),
                const CameraModel& other = test_camera(-0.06))
      : left(one), right(other) {
    right.X_BC.q = right.X_BC.q * so3_exp({0.01, -0.02, 0.015});
  }

  [[nodiscard]] StereoRange ranges(const StereoRangeOptions& options = {}) const {
    return *StereoRange::create(options, left, right);
  }
};

struct Accuracy {
  int measured = 0;
  int beyond = 0;
  int in_1 = 0;
  int in_3 = 0;
  int nearer = 0;  // nearer than the truth by a tenth
  double worst_sigma = 0.0;
  [[nodiscard]] double share(int part) const {
    return static_cast<double>(part) / std::max(1, measured);
  }
};

// Compares the ranges with the walls along their rays.
Accuracy accuracy_of(const StereoScan& stereo, const PaintedRoom& room, const Pose& X_WB) {
  Accuracy accuracy{stereo.measured, stereo.beyond};
  const Vector3d sensor_origin_W = X_WB * stereo.scan.origin_B.cast<double>();
  for (std::size_t i = 0; i < stereo.scan.points_B.size(); ++i) {
    if (!std::isfinite(stereo.sigma_m[i])) continue;
    const Vector3d ray_W = X_WB * stereo.scan.points_B[i].cast<double>() - sensor_origin_W;
    const Pose X_WRay{sensor_origin_W,
                      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), ray_W)};
    const double truth = (room.wall_at(X_WRay, Eigen::Vector2d::Zero()) - sensor_origin_W).norm();
    const double error = ray_W.norm() - truth;
    accuracy.in_1 += std::abs(error) < stereo.sigma_m[i] ? 1 : 0;
    accuracy.in_3 += std::abs(error) < 3.0 * stereo.sigma_m[i] ? 1 : 0;
    accuracy.nearer += error < -0.1 * truth ? 1 : 0;
    accuracy.worst_sigma = std::max(accuracy.worst_sigma, stereo.sigma_m[i] / ray_W.squaredNorm());
  }
  return accuracy;
}

const Pose kHere{{0.5, -0.3, 0.2}, from_rpy(0.1, 0.2, 0.4)};

StereoScan measure(PaintedRoom& room, const Eyes& eyes, StereoRange& ranges, double noise = 1.0,
                   double light = 1.0) {
  return *ranges.measure(room.image(eyes.left, kHere * eyes.left.X_BC, 1000, noise, light),
                         room.image(eyes.right, kHere * eyes.right.X_BC, 1000, noise, light));
}

TEST(StereoRange, ErrorsAreAsLargeAsItsSigmas) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const StereoScan result = measure(room, eyes, ranges);
  const Accuracy accuracy = accuracy_of(result, room, kHere);
  EXPECT_EQ(result.scan.points_B.size(), 7500U);
  EXPECT_EQ(result.scan.utime, 1000);
  EXPECT_LT((result.scan.origin_B - Eigen::Vector3f(0.0F, 0.06F, 0.0F)).norm(), 1e-6F);
  EXPECT_GT(result.measured, 3000);
  EXPECT_GT(accuracy.share(accuracy.in_1), 0.60);
  EXPECT_GT(accuracy.share(accuracy.in_3), 0.985);
  EXPECT_LT(accuracy.share(accuracy.nearer), 0.002);
  EXPECT_LE(accuracy.worst_sigma, ranges.noise_square() * 1.001);
  EXPECT_GT(ranges.reach(), 4.0);
}

// 120 x 90 degrees: the ranges reach as far to the sides as the lens does.
TEST(StereoRange, SpansTheViewOfAWideLens) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes(testing::wide_camera(0.06, 752, 564), testing::wide_camera(-0.06, 752, 564));
  StereoRange ranges = eyes.ranges();
  const StereoScan result = measure(room, eyes, ranges);
  const Accuracy accuracy = accuracy_of(result, room, kHere);
  EXPECT_GT(result.measured, 2000);
  EXPECT_GT(accuracy.share(accuracy.in_1), 0.60);
  EXPECT_GT(accuracy.share(accuracy.in_3), 0.985);
  EXPECT_LT(accuracy.share(accuracy.nearer), 0.002);
  double widest = 0.0;
  for (std::size_t i = 0; i < result.scan.points_B.size(); ++i) {
    const Eigen::Vector3f ray = result.scan.points_B[i] - result.scan.origin_B;
    if (std::isfinite(result.sigma_m[i])) {
      widest = std::max(widest, std::abs(std::atan2(ray.y(), ray.x())) * 1.0);
    }
  }
  EXPECT_GT(rad_to_deg(widest), 52.0);
}

TEST(StereoRange, FlakesThatDriftStayRare) {
  PaintedRoom room({4, 3, 2});
  room.snow(300, kHere.p, 2.0, 0.1);
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const Accuracy accuracy = accuracy_of(measure(room, eyes, ranges), room, kHere);
  EXPECT_GT(accuracy.measured, 2000);
  EXPECT_LT(accuracy.share(accuracy.nearer), 0.005);
}

TEST(StereoRange, LittleLightGivesFewerRangesAndNoFalseOnes) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const Accuracy accuracy = accuracy_of(measure(room, eyes, ranges, 2.0, 0.2), room, kHere);
  EXPECT_GT(accuracy.measured, 100);
  EXPECT_GT(accuracy.share(accuracy.in_3), 0.97);
  EXPECT_LT(accuracy.share(accuracy.nearer), 0.005);
}

TEST(StereoRange, NoiseGivesNoRanges) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  for (const double noise : {0.0, 1.0, 3.0, 10.0}) {
    ImageFrame left = room.image(eyes.left, {}, 0, noise, 0.0);
    ImageFrame right = room.image(eyes.right, {}, 0, noise, 0.0);
    // Noise around a grey that increases to one side, as in water.
    for (int i = 0; i < left.width * left.height; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const int grey = 60 + (i % left.width) / 16;
      left.pixels[k] = static_cast<std::uint8_t>(grey + left.pixels[k]);
      right.pixels[k] = static_cast<std::uint8_t>(grey + right.pixels[k]);
    }
    const StereoScan result = *ranges.measure(left, right);
    EXPECT_LE(result.measured + result.beyond, 4) << "noise " << noise;
  }
}

TEST(StereoRange, FarSurfacesAreBeyondOrUnknownButNeverNear) {
  PaintedRoom room({60, 60, 60});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const StereoScan result = measure(room, eyes, ranges);
  EXPECT_LE(result.measured, 15);
  for (std::size_t i = 0; i < result.sigma_m.size(); ++i) {
    if (!std::isinf(result.sigma_m[i])) continue;
    EXPECT_GT((result.scan.points_B[i] - result.scan.origin_B).norm(), result.scan.reach);
  }
}

TEST(StereoRange, SameImagesSameScan) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  const ImageFrame left = room.image(eyes.left, kHere * eyes.left.X_BC, 0);
  const ImageFrame right = room.image(eyes.right, kHere * eyes.right.X_BC, 0);
  StereoRange one = eyes.ranges();
  StereoRange other = eyes.ranges();
  (void)other.measure(right, left);  // the previous pair must not affect the result
  const StereoScan a = *one.measure(left, right);
  const StereoScan b = *other.measure(left, right);
  ASSERT_EQ(a.measured, b.measured);
  for (std::size_t i = 0; i < a.sigma_m.size(); ++i) {
    if (!std::isfinite(a.sigma_m[i])) continue;
    EXPECT_EQ(a.scan.points_B[i], b.scan.points_B[i]);
  }
}

TEST(StereoRange, ImagesThatAreNoPairAreRefused) {
  PaintedRoom room({4, 3, 2});
  const Eyes eyes;
  StereoRange ranges = eyes.ranges();
  const ImageFrame good = room.image(eyes.left, kHere * eyes.left.X_BC, 0);
  ImageFrame late = good;
  late.utime = 2000;
  EXPECT_FALSE(ranges.measure(good, late));
  ImageFrame colour = good;
  colour.format = ImageFrame::Format::kRgb8;
  EXPECT_FALSE(ranges.measure(colour, good));
  ImageFrame cut = good;
  cut.pixels.pop_back();
  EXPECT_FALSE(ranges.measure(good, cut));
  ImageFrame narrow = good;
  narrow.width /= 2;
  EXPECT_FALSE(ranges.measure(narrow, good));
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

TEST(StereoRange, RejectsOtherCameras) {
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
  options.max_sigma_px = 0.05;  // below the calibration's
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
