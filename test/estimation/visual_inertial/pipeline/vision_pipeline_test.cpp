// The pipeline without a published estimate, in a painted room: it begins from images or a known
// state, and begins again after what goes wrong.

#include "estimation/visual_inertial/pipeline/vision_pipeline.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr Utime kPeriod = 100'000;
constexpr Utime kImuStep = 5'000;
constexpr Utime kStart = 50'000'000;

CameraModel small_camera(double y) { return testing::pinhole_camera(y, 320, 208, 190.0); }

VisionOptions options(int cameras) {
  VisionOptions options;
  options.period_s = to_seconds(kPeriod);
  options.filter.cameras = {small_camera(0.07)};
  if (cameras == 2) options.filter.cameras.push_back(small_camera(-0.07));
  return options;
}

// Swims back and forth before a wall, and turns.
Pose swim(double t) {
  return {{0.3 * std::sin(0.2 * t), 1.5 * std::sin(0.25 * t), -1.0 + 0.2 * std::sin(0.3 * t)},
          from_rpy(0.0, 0.05 * std::sin(0.7 * t), 0.3 * std::sin(0.35 * t))};
}

struct Step {
  VisionEstimate vision;
  std::optional<VisionRestart> restart;
};

/// A pipeline and the world around it, from time 0 on.
class PipelineTest : public ::testing::Test {
 protected:
  void use(const VisionStart& start, int cameras = 2) {
    cameras_ = cameras;
    pipeline_.emplace(options(cameras), start, 1);
  }

  [[nodiscard]] KnownStart known_start() const {
    KnownStart start;
    start.utime = utime(0.0);
    start.X_WB = pose_at(0.0);
    start.v_WB_B = velocity_at(0.0);
    start.bias = BiasPrior{Vector3d::Zero(), Vector3d::Zero(), 0.005, 0.05};
    return start;
  }

  [[nodiscard]] ImageStart image_start() const {
    ImageStart start;
    start.position_W = pose_at(0.0).p;
    start.heading = pose_at(0.0).q;
    return start;
  }

  static Utime utime(double t) { return kStart + from_seconds(t); }

  [[nodiscard]] Vector3d velocity_at(double t) const {
    const Vector3d v_W = (pose_at(t + 1e-4).p - pose_at(t - 1e-4).p) / 2e-4;
    return pose_at(t).q.conjugate() * v_W;
  }

  [[nodiscard]] ImuSample imu_at(Utime at) {
    constexpr double h = 1e-3;
    const double t = to_seconds(at - kStart);
    const Pose before = pose_at(t - h);
    const Pose now = pose_at(t);
    const Pose after = pose_at(t + h);
    ImuSample sample;
    sample.utime = at;
    sample.gyro_B = so3_log(before.q.conjugate() * after.q) / (2 * h) + noise(2e-3);
    const Vector3d acceleration = (before.p - 2 * now.p + after.p) / (h * h);
    sample.accel_B = now.q.conjugate() * (acceleration + Vector3d(0, 0, 9.81)) + noise(2e-2);
    return sample;
  }

  [[nodiscard]] Vector3d noise(double sigma) {
    const double x = random_.normal();
    const double y = random_.normal();
    return sigma * Vector3d(x, y, random_.normal());
  }

  [[nodiscard]] ImageFrame image(int camera) {
    const CameraModel model = small_camera(camera == 0 ? 0.07 : -0.07);
    const double t = to_seconds(now_ - kStart);
    ImageFrame frame = room_.image(model, camera_at(t) * model.X_BC, now_, 1.0, light_);
    frame.camera = camera;
    if (spoil_image_) spoil_image_(frame);
    return frame;
  }

  /// Steps up to the time `end`, s: one per image, each with the samples of 10 ms beyond it.
  std::vector<Step> run_until(double end) {
    std::vector<Step> steps;
    for (; now_ <= utime(end); now_ += kPeriod) {
      VisionInput input;
      input.now = now_ + VisionPipeline::kImuBeyondImage;
      for (; next_imu_ <= input.now; next_imu_ += kImuStep) {
        ImuSample sample = imu_at(next_imu_);
        if (spoil_imu_) spoil_imu_(sample);
        if (imu_is_on_) input.imu.push_back(sample);
      }
      if (has_depth_) input.depth.push_back({now_, -pose_at(to_seconds(now_ - kStart)).p.z()});
      if (published_) input.published = *published_;
      if (has_speed_) input.expected_v_B = velocity_at(to_seconds(now_ - kStart));
      input.left = image(0);
      if (cameras_ == 2) input.right = image(1);
      const VisionEstimate vision = pipeline_->step(input);
      steps.push_back({vision, pipeline_->restarted()});
    }
    return steps;
  }

  static std::vector<VisionRestart> restarts(const std::vector<Step>& steps) {
    std::vector<VisionRestart> all;
    for (const Step& step : steps) {
      if (step.restart) all.push_back(*step.restart);
    }
    return all;
  }

  /// Distance from the truth, m.
  [[nodiscard]] double error_of(const VisionEstimate& vision) const {
    return (pose_at(to_seconds(vision.estimate.utime - kStart)).p - vision.estimate.X_WB.p).norm();
  }

  /// By the estimate's own covariance.
  [[nodiscard]] double sigmas_of(const VisionEstimate& vision) const {
    const Pose truth = pose_at(to_seconds(vision.estimate.utime - kStart));
    const Vector3d e = truth.p - vision.estimate.X_WB.p;
    return std::sqrt(e.dot(vision.estimate.covariance.topLeftCorner<3, 3>().inverse() * e));
  }

  [[nodiscard]] double heading_error_deg(const VisionEstimate& vision) const {
    const Pose truth = pose_at(to_seconds(vision.estimate.utime - kStart));
    return rad_to_deg(to_rpy(truth.q * vision.estimate.X_WB.q.conjugate()).z());
  }

  std::function<Pose(double)> pose_at = swim;
  std::function<Pose(double)> camera_at = swim;  ///< Pose at which the images are taken.
  std::function<void(ImuSample&)> spoil_imu_;
  testing::PaintedRoom room_{{3, 4, 2}};
  Random random_{7};
  std::optional<VisionPipeline> pipeline_;
  std::optional<StateEstimate> published_;
  int cameras_ = 2;
  double light_ = 1.0;
  bool imu_is_on_ = true;
  bool has_depth_ = true;
  std::function<void(ImageFrame&)> spoil_image_;
  bool has_speed_ = false;
  Utime now_ = kStart;
  Utime next_imu_ = kStart - 100'000;
};

TEST_F(PipelineTest, BeginsFromImagesWithoutAPublishedEstimate) {
  use(image_start());
  const std::vector<Step> steps = run_until(4.0);
  EXPECT_FALSE(steps.front().vision.estimate.valid);
  EXPECT_TRUE(restarts(steps).empty());
  ASSERT_TRUE(steps.back().vision.is_good()) << to_sentence(steps.back().vision.fault);
  EXPECT_LT(error_of(steps.back().vision), 0.1);
  EXPECT_EQ(steps.back().vision.init_utime, steps.front().vision.init_utime);
}

TEST_F(PipelineTest, BeginsAtAKnownStateAtOnce) {
  use(known_start());
  const std::vector<Step> steps = run_until(3.0);
  EXPECT_TRUE(steps.front().vision.estimate.valid);
  EXPECT_TRUE(restarts(steps).empty());
  for (const Step& step : steps) EXPECT_LT(error_of(step.vision), 0.06);
}

TEST_F(PipelineTest, WaitsForAPublishedEstimateInADive) {
  use(PublishedStart{});
  for (const Step& step : run_until(1.0)) EXPECT_FALSE(step.vision.is_good());
}

// A known start is as good as a published estimate of the same values.
TEST_F(PipelineTest, GivesTheSameEstimatesFromAPublishedAndFromAKnownStart) {
  KnownStart start = known_start();
  start.bias = {};
  start.tilt_sigma_deg = 0.5;
  start.yaw_sigma_deg = 1.0;
  start.speed_sigma = 0.05;
  use(start);
  const std::vector<Step> known = run_until(2.0);
  now_ = kStart;
  next_imu_ = kStart - 100'000;
  random_ = Random(7);
  room_ = testing::PaintedRoom({3, 4, 2});
  use(PublishedStart{});
  StateEstimate published;
  published.utime = start.utime;
  published.valid = true;
  published.X_WB = start.X_WB;
  published.v_WB_B = start.v_WB_B;
  published.covariance.topLeftCorner<3, 3>() = 1e-4 * Eigen::Matrix3d::Identity();
  const double yaw = deg_to_rad(1.0);
  published.covariance.bottomRightCorner<3, 3>() = yaw * yaw * Eigen::Matrix3d::Identity();
  published_ = published;
  const std::vector<Step> of_dive = run_until(2.0);
  ASSERT_EQ(known.size(), of_dive.size());
  for (std::size_t i = 0; i < known.size(); ++i) {
    EXPECT_LT((known[i].vision.estimate.X_WB.p - of_dive[i].vision.estimate.X_WB.p).norm(), 1e-9);
    EXPECT_EQ(known[i].vision.fault, of_dive[i].vision.fault);
  }
}

// In the dark it dead-reckons; when the images return it begins again from them.
TEST_F(PipelineTest, BeginsAgainFromImagesAfterLongDarkness) {
  has_speed_ = true;
  use(known_start());
  ASSERT_TRUE(run_until(6.0).back().vision.is_good());
  light_ = 0.0;
  const std::vector<Step> dark = run_until(36.0);
  EXPECT_TRUE(restarts(dark).empty());
  EXPECT_TRUE(dark.back().vision.estimate.valid);
  EXPECT_EQ(dark.back().vision.fault, VisionFault::kDark);
  const double dead_reckoned_m = error_of(dark.back().vision);
  light_ = 1.0;
  const std::vector<Step> light = run_until(42.0);
  ASSERT_EQ(restarts(light).size(), 1U);
  EXPECT_FALSE(restarts(light)[0].has_failed);
  EXPECT_THAT(restarts(light)[0].reason, HasSubstr("no usable image for 30."));
  const VisionEstimate& last = light.back().vision;
  ASSERT_TRUE(last.is_good()) << to_sentence(last.fault);
  EXPECT_GT(last.init_utime, utime(36.0));
  EXPECT_LT(error_of(last), dead_reckoned_m + 0.3);
  EXPECT_LT(sigmas_of(last), 4.0);
  EXPECT_LT(std::abs(heading_error_deg(last)), 6.0);
}

TEST_F(PipelineTest, GoesOnAfterShortDarkness) {
  has_speed_ = true;
  use(known_start());
  run_until(6.0);
  light_ = 0.0;
  run_until(14.0);
  light_ = 1.0;
  const std::vector<Step> light = run_until(20.0);
  EXPECT_TRUE(restarts(light).empty());
  EXPECT_TRUE(light.back().vision.is_good());
}

// The noise of a dark image is sharp: no scene is blurred beside it.
TEST_F(PipelineTest, BeginsAfterImagesOfNothingButNoise) {
  use(known_start());
  Random of_pixels(3);
  spoil_image_ = [&](ImageFrame& frame) {
    for (auto& pixel : frame.pixels) pixel = static_cast<std::uint8_t>(of_pixels.bits() % 64);
  };
  run_until(1.0);
  spoil_image_ = nullptr;
  EXPECT_TRUE(run_until(6.0).back().vision.is_good());
}

// Smoother ground, or another lamp: what remains so is the scene, not blur.
TEST_F(PipelineTest, UsesASceneThatHasBecomeSmoother) {
  use(known_start());
  run_until(4.0);
  spoil_image_ = [](ImageFrame& frame) {
    const std::vector<std::uint8_t> sharp = frame.pixels;
    const auto width = static_cast<std::ptrdiff_t>(frame.width);
    const auto at = [&](std::ptrdiff_t x, std::ptrdiff_t y) {
      x = std::clamp<std::ptrdiff_t>(x, 0, width - 1);
      y = std::clamp<std::ptrdiff_t>(y, 0, frame.height - 1);
      return static_cast<int>(sharp[static_cast<std::size_t>(y * width + x)]);
    };
    for (std::ptrdiff_t y = 0; y < frame.height; ++y) {
      for (std::ptrdiff_t x = 0; x < width; ++x) {
        int sum = 0;
        for (int k = 0; k < 81; ++k) sum += at(x + k % 9 - 4, y + k / 9 - 4);
        frame.pixels[static_cast<std::size_t>(y * width + x)] = static_cast<std::uint8_t>(sum / 81);
      }
    }
  };
  EXPECT_EQ(run_until(4.5).back().vision.fault, VisionFault::kBlurred);
  EXPECT_NE(run_until(30.0).back().vision.fault, VisionFault::kBlurred);
}

TEST_F(PipelineTest, BeginsAgainAfterALongGapOfTheImu) {
  use(known_start());
  ASSERT_TRUE(run_until(6.0).back().vision.is_good());
  imu_is_on_ = false;
  EXPECT_TRUE(restarts(run_until(8.0)).empty());
  imu_is_on_ = true;
  const std::vector<Step> after = run_until(20.0);  // for 10 s it is suspect
  ASSERT_EQ(restarts(after).size(), 1U);
  EXPECT_FALSE(restarts(after)[0].has_failed);
  EXPECT_THAT(restarts(after)[0].reason, HasSubstr("no IMU samples for 2."));
  ASSERT_TRUE(after.back().vision.is_good()) << to_sentence(after.back().vision.fault);
  EXPECT_GT(horizontal_sigma(after.back().vision.estimate), 0.5) << "it has moved meanwhile";
  EXPECT_LT(sigmas_of(after.back().vision), 3.5);
}

// An accelerometer that errs by 2 g for a fifth of a second.
TEST_F(PipelineTest, BeginsAgainAfterADivergence) {
  use(known_start());
  ASSERT_TRUE(run_until(12.0).back().vision.is_good());
  spoil_imu_ = [](ImuSample& sample) { sample.accel_B.x() += 20.0; };
  std::vector<Step> bad = run_until(12.2);
  spoil_imu_ = nullptr;
  const std::vector<Step> after = run_until(24.0);
  bad.insert(bad.end(), after.begin(), after.end());
  ASSERT_FALSE(restarts(bad).empty());
  EXPECT_TRUE(restarts(bad)[0].has_failed);
  EXPECT_THAT(restarts(bad)[0].reason, HasSubstr("the filter has diverged: "));
  const VisionEstimate& last = bad.back().vision;
  ASSERT_TRUE(last.is_good()) << to_sentence(last.fault);
  EXPECT_LT(sigmas_of(last), 3.5);
  EXPECT_LT(std::abs(heading_error_deg(last)), 6.0);
}

// One camera whose images roll while the IMU does not: features move as no motion of the vehicle
// lets them, so that none is tracked for long, and none is used.
TEST_F(PipelineTest, BeginsAgainIfItUsesNoFeatureForLong) {
  // Its speed changes, which one camera needs to begin again.
  pose_at = [](double t) {
    return Pose{{0.0, 0.1 * t - 2.0 + 0.15 * std::sin(1.2 * t), -1.0}, {1, 0, 0, 0}};
  };
  camera_at = [this](double t) {
    return Pose{pose_at(t).p, from_rpy(t > 4.0 && t < 20.0 ? 0.6 * (t - 4.0) : 0.0, 0.0, 0.0)};
  };
  has_speed_ = true;
  use(known_start(), 1);
  ASSERT_TRUE(run_until(4.0).back().vision.is_good());
  const std::vector<Step> steps = run_until(32.0);
  const std::vector<VisionRestart> begun = restarts(steps);
  ASSERT_EQ(begun.size(), 1U);
  EXPECT_TRUE(begun[0].has_failed);
  EXPECT_THAT(begun[0].reason, HasSubstr("the filter used no feature for 15."));
  EXPECT_NEAR(to_seconds(begun[0].utime - utime(4.0)), 15.0, 1.0);
  const VisionEstimate& last = steps.back().vision;
  ASSERT_TRUE(last.is_good()) << to_sentence(last.fault);
  EXPECT_LT(sigmas_of(last), 3.5);
}

// With one camera at rest no feature has a parallax, and nothing is wrong.
TEST_F(PipelineTest, DoesNotBeginAgainAtRest) {
  pose_at = camera_at = [](double) { return Pose{{0.0, 0.5, -1.0}, {1, 0, 0, 0}}; };
  use(image_start(), 1);
  const std::vector<Step> steps = run_until(25.0);
  EXPECT_TRUE(restarts(steps).empty());
  EXPECT_TRUE(steps.back().vision.is_good()) << to_sentence(steps.back().vision.fault);
  EXPECT_LT(error_of(steps.back().vision), 0.05);
}

}  // namespace
}  // namespace dive::estimation
