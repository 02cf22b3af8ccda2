#include "estimation/dataset/recording_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dive::estimation {
namespace {

using ::testing::HasSubstr;

/// Two seconds of images at 20 Hz, an IMU at 200 Hz, depth and velocity at 10 Hz.
Recording two_seconds() {
  Recording made;
  made.cameras.resize(2);
  for (Utime k = 0; k < 400; ++k) {
    const Utime utime = 1'000'000 + 5000 * k;
    made.imu.emplace_back().utime = utime;
    if (k % 20 == 0) made.depth.push_back({utime, 2.0});
    if (k % 20 == 0) made.velocity.push_back({utime, {0.4, 0.0, 0.0}, 0.02});
    if (k % 10 != 0) continue;
    for (RecordedCamera& camera : made.cameras) {
      camera.images.push_back(
          {utime, "image", [] { return tl::expected<ImageFrame, std::string>(ImageFrame{}); }});
    }
  }
  return made;
}

tl::expected<ImageFrame, std::string> damaged() { return tl::make_unexpected("damaged"); }

std::vector<FeedStep> steps_of(const Recording& recording, Utime begin) {
  RecordingFeed feed(recording, {.begin = begin});
  std::vector<FeedStep> steps;
  while (auto step = feed.next()) {
    steps.push_back(std::move(*step));
    if (steps.size() > 1000) break;
  }
  return steps;
}

TEST(RecordingFeed, AClockThatJumpsEndsTheWaitForImages) {
  Recording jumped = two_seconds();
  for (RecordedCamera& camera : jumped.cameras) {
    for (std::size_t i = 20; i < camera.images.size(); ++i) {
      camera.images[i].utime += 1'600'000'000'000'000;
    }
  }
  for (const bool imu_too : {false, true}) {
    if (imu_too) {
      for (std::size_t i = 200; i < jumped.imu.size(); ++i) {
        jumped.imu[i].utime += 1'600'000'000'000'000;
      }
    }
    const std::vector<FeedStep> steps = steps_of(jumped, 1'000'000);
    EXPECT_LT(steps.size(), 60U);
    EXPECT_EQ(steps.back().image, 39U);
    std::size_t samples = 0;
    for (const FeedStep& step : steps) samples += step.input.imu.size();
    EXPECT_GE(samples, 393U) << "until the last image";
  }
}

// As in a dive: the samples of the time without images arrive in steps of two periods.
TEST(RecordingFeed, StepsThroughAGapWithSamples) {
  Recording gap = two_seconds();
  auto& images = gap.cameras[0].images;
  images.erase(images.begin() + 10, images.begin() + 30);
  std::size_t without = 0;
  for (const FeedStep& step : steps_of(gap, 1'000'000)) {
    if (step.has_image) continue;
    ++without;
    EXPECT_LE(step.input.imu.size(), 20U);
  }
  EXPECT_EQ(without, 10U);
}

TEST(RecordingFeed, LeavesOutImagesThatCannotBeRead) {
  Recording torn = two_seconds();
  torn.cameras[0].images[3].read = damaged;
  torn.cameras[1].images[5].read = damaged;
  const std::vector<FeedStep> steps = steps_of(torn, 1'000'000);
  ASSERT_EQ(steps.size(), 40U);
  EXPECT_FALSE(steps[3].input.left);
  EXPECT_FALSE(steps[3].input.right);
  EXPECT_THAT(steps[3].left_error, HasSubstr("damaged"));
  EXPECT_TRUE(steps[5].input.left);
  EXPECT_FALSE(steps[5].input.right);
  EXPECT_THAT(steps[5].right_error, HasSubstr("damaged"));
  EXPECT_TRUE(steps[6].input.right);
}

TEST(RecordingFeed, BeginsAllSensorsAtTheSameTime) {
  const std::vector<FeedStep> steps = steps_of(two_seconds(), 2'000'000);
  EXPECT_EQ(steps.front().image, 20U);
  for (const FeedStep& step : steps) {
    for (const ImuSample& sample : step.input.imu) EXPECT_GE(sample.utime, 2'000'000);
    for (const DepthSample& sample : step.input.depth) EXPECT_GE(sample.utime, 2'000'000);
    for (const VelocitySample& sample : step.input.velocity) EXPECT_GE(sample.utime, 2'000'000);
  }
}

}  // namespace
}  // namespace dive::estimation
