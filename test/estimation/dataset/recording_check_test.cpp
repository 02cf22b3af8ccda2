// Recordings that are wrong in one respect each: the diagnostic, its place and its severity.

#include "estimation/dataset/recording_check.h"

#include <cmath>
#include <functional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimation/dataset/sample_screen.h"
#include "test/estimation/dataset/asl_folder.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using ::testing::HasSubstr;

constexpr int kImages = 20;

CameraModel camera(double y) {
  CameraModel model = testing::test_camera(y);
  model.width = 96;
  model.height = 64;
  model.cx = 48;
  model.cy = 32;
  return model;
}

/// A second of a stereo pair, an IMU at 200 Hz, depth and truth: nothing is wrong with it. The
/// lines of its samples are their index plus 2.
Recording intact() {
  const std::string image = testing::fresh_folder() + "/image.png";
  ImageFrame frame;
  frame.width = 96;
  frame.height = 64;
  frame.pixels.assign(96 * 64, 90);
  testing::write_png(image, frame);
  Recording recording;
  recording.source = "pool";
  recording.imu_rate_hz = 200.0;
  for (std::uint32_t k = 0; k <= 200; ++k) {
    ImuSample sample;
    sample.utime = 1'000'000 + 5000 * k;
    sample.accel_B.z() = 9.81;
    recording.imu.push_back(sample);
    recording.imu_origin.lines.push_back(k + 2);
    recording.truth.emplace_back().utime = sample.utime;
    recording.truth_origin.lines.push_back(k + 2);
    recording.depth.push_back({sample.utime, 2.0});
    recording.depth_origin.lines.push_back(k + 2);
  }
  recording.has_true_attitude = true;
  recording.imu_origin.file = "imu0/data.csv";
  recording.depth_origin.file = "depth0/data.csv";
  recording.truth_origin.file = "truth/data.csv";
  for (int c = 0; c < 2; ++c) {
    RecordedCamera eye;
    eye.model = camera(c == 0 ? 0.06 : -0.06);
    eye.calibration_file = fmt::format("cam{}/sensor.yaml", c);
    eye.resolution_line = 16;
    eye.images_origin.file = fmt::format("cam{}/data.csv", c);
    for (std::uint32_t k = 0; k < kImages; ++k) {
      eye.images.push_back({1'000'000 + 50'000 * k, image});
      eye.images_origin.lines.push_back(k + 2);
    }
    recording.cameras.push_back(eye);
  }
  return recording;
}

std::string text_of(const Diagnostics& diagnostics) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics.list()) text += render(diagnostic, false);
  return text;
}

struct Damage {
  std::function<void(Recording&)> apply;
  const char* expected;
};

void expect_each(const std::vector<Damage>& damages, const RunOptions& options) {
  for (const auto& [apply, expected] : damages) {
    Recording recording = intact();
    apply(recording);
    screen_samples(recording);
    check_recording(recording, options);
    EXPECT_LE(recording.diagnostics.list().size(), 3U) << text_of(recording.diagnostics);
    EXPECT_THAT(text_of(recording.diagnostics), HasSubstr(expected));
  }
}

template <typename Sample>
void shift(std::vector<Sample>& samples, Utime by) {
  for (Sample& sample : samples) sample.utime += by;
}

void keep_each(std::vector<ImuSample>& imu, std::size_t n) {
  std::vector<ImuSample> kept;
  for (std::size_t i = 0; i < imu.size(); i += n) kept.push_back(imu[i]);
  imu = std::move(kept);
}

TEST(RecordingCheck, FindsNothingWrongWithAnIntactRecording) {
  for (const EstimatorKind kind : {EstimatorKind::kVisualInertial, EstimatorKind::kPrimitive}) {
    Recording recording = intact();
    RunOptions options;
    options.estimator = kind;
    screen_samples(recording);
    check_recording(recording, options);
    EXPECT_EQ(text_of(recording.diagnostics), "");
    EXPECT_EQ(recording.imu.size(), 201U);
    EXPECT_EQ(recording.truth.size(), 201U);
  }
}

TEST(RecordingCheck, ReportsWhatCannotBeEstimated) {
  expect_each(
      {{[](Recording& r) { r.cameras[0].model.height = r.cameras[1].model.height = 48; },
        "cam0/sensor.yaml:16: error: images of 96 x 48 pixels; the estimator needs at least 64"},
       {[](Recording& r) { r.cameras[0].model.width = r.cameras[1].model.width = 100; },
        "image.png: an image of 96 x 64 pixels; cam0/sensor.yaml:16 states 100 x 64"},
       {[](Recording& r) { r.cameras[1].model.width = 100; },
        "cam1/sensor.yaml:16: error: the right camera's images have 100 x 64 pixels, the left "
        "one's 96 x 64"},
       {[](Recording& r) {
          for (RecordedImage& image : r.cameras[0].images) image.path = "/nowhere.png";
        },
        "cam0/data.csv:2: error: /nowhere.png: no such file; none of the 20 images can be read"},
       {[](Recording& r) { r.cameras[1].images.clear(); },
        "cam1/data.csv: error: camera 1 has no images"},
       {[](Recording& r) { r.imu.clear(); }, "imu0/data.csv: error: there are no IMU samples"},
       {[](Recording& r) {
          for (std::size_t i = 0; i < r.imu.size(); ++i) {
            r.imu[i].utime = 1'000'000 + 5 * static_cast<Utime>(i);
          }
        },
        "imu0/data.csv: error: the IMU was recorded at 2e+05 Hz, faster than any IMU: are its "
        "stamps in nanoseconds?"},
       {[](Recording& r) { r.cameras[1].model.X_BC = r.cameras[0].model.X_BC; },
        "cam1/sensor.yaml:16: error: the right camera is 0 m from the left one"},
       {[](Recording& r) { keep_each(r.imu, 10); },
        "imu0/data.csv: error: the IMU was recorded at 20 Hz; the visual-inertial estimator needs "
        "at least 50 Hz"},
       {[](Recording& r) { shift(r.imu, 2'000'000); },
        "cam0/data.csv: error: its images are from 1.000 s to 1.950 s, the IMU's samples "
        "(imu0/data.csv) from 3.000 s to 4.000 s"},
       {[](Recording& r) {
          for (ImuSample& sample : r.imu) sample.accel_B /= 9.81;
        },
        "imu0/data.csv: error: the median specific force is 1 m/s^2"}},
      {});
  RunOptions from_truth;
  from_truth.start = RunStart::kTruth;
  expect_each({{[](Recording& r) { shift(r.truth, 5'000'000); },
                "truth/data.csv: error: its poses are from 6.000 s to 7.000 s, the images from "
                "1.000 s to 1.950 s"}},
              from_truth);
  RunOptions primitive;
  primitive.estimator = EstimatorKind::kPrimitive;
  expect_each({{[](Recording& r) { r.depth.clear(); }, "pool: error: the recording has no depth"},
               {[](Recording& r) { keep_each(r.imu, 50); },
                "at 4 Hz; the primitive estimator needs at least 10 Hz"},
               {[](Recording& r) { shift(r.depth, 5'000'000); },
                "depth0/data.csv: error: its samples are from 6.000 s"},
               {[](Recording& r) { r.cameras[0].images[19].utime += 1'600'000'000'000'000; },
                "cam0/data.csv:21: error: 1 gap(s) without images"}},
              primitive);
  primitive.use_depth = false;
  expect_each({{[](Recording&) {}, "pool: error: the primitive estimator needs the depth"}},
              primitive);
}

TEST(RecordingCheck, WarnsOfWhatMakesTheEstimateWorse) {
  expect_each(
      {{[](Recording& r) { r.imu[7].gyro_B.x() = 5000.0; },
        "imu0/data.csv:9: warning: an angular rate of 5000 rad/s; no IMU measures more than 100; "
        "the sample is refused"},
       {[](Recording& r) { r.imu[7].gyro_B.x() = r.imu[9].accel_B.y() = -1e300; },
        "imu0/data.csv:9: warning: an angular rate of 1e+300 rad/s; no IMU measures more than "
        "100; it and 1 more such samples are refused"},
       {[](Recording& r) { r.depth[3].depth_m = 101'325.0; },
        "depth0/data.csv:5: warning: a depth of 101325 m"},
       {[](Recording& r) { r.truth[4].X_WB.p.y() = 1e300; },
        "truth/data.csv:6: warning: a true position 1e+300 m from the origin"},
       {[](Recording& r) { r.depth[3].depth_m = std::nan(""); },
        "depth0/data.csv:5: warning: a depth that is not finite"},
       {[](Recording& r) { r.truth[4].X_WB.q.coeffs().setZero(); },
        "truth/data.csv:6: warning: a true attitude whose quaternion is not of length 1"},
       {[](Recording& r) { r.cameras[0].images[19].utime += 5'000'000; },
        "cam0/data.csv:21: warning: 1 gap(s) without images; the longest, of 5.050 s, ends here"},
       {[](Recording& r) { r.imu[7].gyro_B.x() = -50.0; },
        "imu0/data.csv:9: warning: 1 sample(s) at or beyond 34.9 rad/s"},
       {[](Recording& r) {
          r.imu_noise.gyro_range = 5.2;
          r.imu[7].gyro_B.x() = -6.0;
        },
        "imu0/data.csv:9: warning: 1 sample(s) at or beyond 5.2 rad/s"},
       {[](Recording& r) { keep_each(r.imu, 2); }, "at 100 Hz; its calibration states 200 Hz"},
       {[](Recording& r) {
          keep_each(r.imu, 3);
          r.imu_rate_hz = 0.0;
        },
        "at 66.7 Hz; below 100 Hz"},
       {[](Recording& r) {
          r.imu.erase(r.imu.begin() + 50, r.imu.begin() + 90);
          auto& lines = r.imu_origin.lines;
          lines.erase(lines.begin() + 50, lines.begin() + 90);
        },
        "imu0/data.csv:92: warning: 1 gap(s) without IMU samples, the longest of 0.205 s"},
       {[](Recording& r) { r.imu.resize(120); },
        "cam0/data.csv:16: warning: 6 of 20 images are at times without IMU samples"},
       {[](Recording& r) { shift(r.cameras[1].images, 20'000); },
        "cam1/data.csv: warning: 20 of 20 left images have no right one"},
       {[](Recording& r) { r.depth.clear(); }, "pool: warning: the recording has no depth"},
       {[](Recording& r) { shift(r.depth, 5'000'000); }, "depth0/data.csv: warning: its samples"},
       {[](Recording& r) { shift(r.truth, 5'000'000); }, "truth/data.csv: warning: its poses"}},
      {});
}

// What is refused is not estimated from, and what remains keeps its lines.
TEST(RecordingCheck, RemovesWhatIsIgnored) {
  Recording recording = intact();
  recording.imu[7].gyro_B.x() = 5000.0;
  recording.imu[7].accel_B.z() = 1.0;
  screen_samples(recording);
  ASSERT_EQ(recording.imu.size(), 200U);
  EXPECT_EQ(recording.imu[7].accel_B.z(), 9.81);
  EXPECT_EQ(recording.imu_origin.lines[6], 8U);
  EXPECT_EQ(recording.imu_origin.lines[7], 10U);
  Recording late = intact();
  late.velocity.push_back({1'500'000, {0.4, 0.0, 0.0}, 0.02});
  shift(late.truth, 5'000'000);
  shift(late.depth, 5'000'000);
  shift(late.velocity, 5'000'000);
  check_recording(late, {});
  EXPECT_TRUE(late.truth.empty());
  EXPECT_TRUE(late.depth.empty()) << "loops would be closed as with a depth";
  EXPECT_TRUE(late.velocity.empty()) << "the expected speed would not be used";
}

// The greatest of three values hides a NaN, depending on its axis.
TEST(RecordingCheck, RefusesANaNOnEachAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    Recording recording = intact();
    recording.imu[3].gyro_B[axis] = std::nan("");
    recording.imu[5].accel_B[axis] = std::nan("");
    recording.velocity.push_back({1'500'000, {0.4, 0.0, 0.0}, 0.02});
    recording.velocity[0].v_B[axis] = std::nan("");
    recording.truth[8].X_WB.p[axis] = std::nan("");
    screen_samples(recording);
    EXPECT_EQ(recording.imu.size(), 199U) << axis;
    EXPECT_TRUE(recording.velocity.empty()) << axis;
    EXPECT_EQ(recording.truth.size(), 200U) << axis;
    EXPECT_THAT(
        text_of(recording.diagnostics),
        HasSubstr("imu0/data.csv:5: warning: an angular rate that is not finite; it and 1"));
  }
}

// A damaged first image is no reason to refuse the others.
TEST(RecordingCheck, PassesOverImagesThatCannotBeRead) {
  Recording recording = intact();
  recording.cameras[0].images[0].path = recording.cameras[1].images[0].path = "/nowhere.png";
  check_recording(recording, {});
  EXPECT_TRUE(recording.diagnostics.ok()) << text_of(recording.diagnostics);
}

TEST(RecordingCheck, RefusesAnImuInAnotherUnit) {
  Recording recording = intact();
  for (std::size_t i = 0; i < 15; ++i) recording.imu[10 * i].gyro_B.z() = 200.0;
  screen_samples(recording);
  EXPECT_FALSE(recording.diagnostics.ok());
  EXPECT_THAT(text_of(recording.diagnostics), HasSubstr("15 of 201 samples are not what an IMU"));
}

}  // namespace
}  // namespace dive::estimation
