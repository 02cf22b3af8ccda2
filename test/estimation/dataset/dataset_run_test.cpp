// A recording of a curved path through a painted room, estimated from its files.

#include "estimation/dataset/dataset_run.h"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/random.h"
#include "estimation/dataset/trajectory_error.h"
#include "test/estimation/dataset/asl_folder.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kSeconds = 4.0;
constexpr double kStart = 100.0;

// At rest for a second, then accelerating to half a metre a second, swaying.
Pose pose_at_time(double t) {
  const double s = std::max(0.0, t - 1.0);
  const double x = 0.25 * s - 0.25 * std::sin(s);
  return {{-1.0 + x, 0.3 * (1 - std::cos(s)), -1.0 + 0.1 * (1 - std::cos(s))},
          from_rpy(0.05 * (1 - std::cos(2 * s)), 0.1 * (1 - std::cos(s)), 0.2 * (1 - std::cos(s)))};
}

struct Imu {
  Vector3d gyro;
  Vector3d accel;
};

// By differences of the poses.
Imu imu_at(double t) {
  constexpr double h = 1e-4;
  const Pose a = pose_at_time(t - h);
  const Pose b = pose_at_time(t);
  const Pose c = pose_at_time(t + h);
  const Vector3d acceleration = (a.p - 2 * b.p + c.p) / (h * h);
  return {so3_log(a.q.conjugate() * c.q) / (2 * h),
          b.q.conjugate() * (acceleration + Vector3d(0, 0, 9.81))};
}

// Half the usual size, for a quarter of the rendering time.
CameraModel small_camera(double y) {
  CameraModel camera = testing::test_camera(y);
  camera.width /= 2;
  camera.height /= 2;
  camera.fx *= 0.5;
  camera.fy *= 0.5;
  camera.cx = 0.5 * camera.cx - 0.25;
  camera.cy = 0.5 * camera.cy - 0.25;
  return camera;
}

// Writes a recording, and returns its folder.
std::string record(const std::array<CameraModel, 2>& cameras) {
  const std::string made = testing::fresh_folder();
  testing::PaintedRoom room({4, 3, 2});
  const auto ns = [](double t) { return std::llround((kStart + t) * 1e9); };
  std::string csv[2];
  std::string imu;
  std::string depth;
  std::string truth;
  for (int k = 0; k <= 20 * kSeconds; ++k) {
    const double t = 0.05 * k;
    for (std::size_t c = 0; c < 2; ++c) {
      csv[c] += fmt::format("{},{}.png\n", ns(t), ns(t));
      testing::write_png(fmt::format("{}/cam{}/data/{}.png", made, c, ns(t)),
                         room.image(cameras[c], pose_at_time(t) * cameras[c].X_BC, 0));
    }
  }
  const Vector3d gyro_bias(0.02, -0.05, 0.08);  // as MEMS units have
  const Vector3d accel_bias(0.1, -0.2, 0.15);
  Random random(5);
  for (int k = -2; k <= 200 * kSeconds + 4; ++k) {
    const double t = 0.005 * k;
    const Imu at = imu_at(t);
    const Pose X = pose_at_time(t);
    const auto noisy = [&](const Vector3d& v, double sigma) {
      return fmt::format(",{},{},{}", v.x() + sigma * random.normal(),
                         v.y() + sigma * random.normal(), v.z() + sigma * random.normal());
    };
    imu += fmt::format("{}", ns(t)) + noisy(at.gyro + gyro_bias, 2e-3) +
           noisy(at.accel + accel_bias, 2e-2) + "\n";
    const Vector3d v = (pose_at_time(t + 1e-4).p - pose_at_time(t - 1e-4).p) / 2e-4;
    truth += fmt::format("{},{},{},{},{},{},{},{}", ns(t), X.p.x(), X.p.y(), X.p.z(), X.q.w(),
                         X.q.x(), X.q.y(), X.q.z()) +
             noisy(v, 0.0) + noisy(gyro_bias, 0.0) + noisy(accel_bias, 0.0) + "\n";
    if (k % 10 == 0) {
      depth += fmt::format("{},{}\n", ns(t), -X.p.z() + 0.01 * random.normal());
    }
  }
  for (std::size_t c = 0; c < 2; ++c) {
    testing::write_text(fmt::format("{}/cam{}/data.csv", made, c), csv[c]);
    testing::write_text(fmt::format("{}/cam{}/sensor.yaml", made, c),
                        testing::camera_yaml(cameras[c]));
  }
  testing::write_text(made + "/imu0/data.csv", imu);
  testing::write_text(made + "/imu0/sensor.yaml", testing::imu_yaml());
  testing::write_text(made + "/depth0/data.csv", depth);
  testing::write_text(made + "/state_groundtruth_estimate0/data.csv", truth);
  return made;
}

const std::string& recording() {
  static const std::string folder = record({small_camera(0.06), small_camera(-0.06)});
  return folder;
}

struct Judged {
  DatasetRun run;
  double rmse_m = 1e9;
  double nees_position = 1e9;
};

Judged judged(const RunOptions& options, const Recording& dataset) {
  SteadyClock clock;
  double share = 0.0;
  auto run = run_on(dataset, options, clock, [&](double now) { share = now; });
  EXPECT_TRUE(run) << run.error();
  EXPECT_EQ(share, 1.0);
  Trajectory truth;
  for (const TruePose& pose : dataset.truth) truth.push_back({pose.utime, pose.X_WB});
  Trajectory estimate;
  for (const StateEstimate& e : run->estimates) estimate.push_back({e.utime, e.X_WB});
  Judged result{*run};
  result.rmse_m = absolute_error(pair_up(estimate, truth), Pose{}).rmse_m;
  result.nees_position = nees(run->estimates, truth).position;
  return result;
}

Judged judged(const RunOptions& options, const std::string& folder = recording()) {
  const auto dataset = read_asl_dataset(folder);
  EXPECT_TRUE(dataset) << dataset.error();
  return judged(options, *dataset);
}

/// Five true velocities a second.
void add_velocities(Recording& dataset) {
  for (std::size_t i = 0; i < dataset.truth.size(); i += 40) {
    const TruePose& pose = dataset.truth[i];
    dataset.velocity.push_back({pose.utime, pose.X_WB.q.conjugate() * *pose.v_W, 0.02});
  }
}

/// Replaces the images of this time (s) by noise of two grey levels.
void darken(Recording& dataset, double begin, double end) {
  for (RecordedCamera& camera : dataset.cameras) {
    for (RecordedImage& image : camera.images) {
      const double t = to_seconds(image.utime) - kStart;
      if (t < begin || t >= end) continue;
      image.read = [width = camera.model.width, height = camera.model.height, t] {
        ImageFrame frame;
        frame.width = width;
        frame.height = height;
        Random random(static_cast<std::uint64_t>(1000.0 * t));
        for (int k = 0; k < width * height; ++k) {
          frame.pixels.push_back(static_cast<std::uint8_t>(2.0 + random.uniform(0.0, 2.0)));
        }
        return tl::expected<ImageFrame, std::string>(std::move(frame));
      };
    }
  }
}

TEST(DatasetRun, LocalisesInStereoFromRest) {
  const Judged stereo = judged({});
  EXPECT_EQ(stereo.run.frames, 81);
  EXPECT_EQ(stereo.run.health.images.rejected(), 0) << stereo.run.health.images.last;
  EXPECT_EQ(stereo.run.health.failure, "");
  EXPECT_TRUE(stereo.run.health.restarts.empty());
  EXPECT_GT(stereo.run.estimates.size(), 60U);
  EXPECT_GT(stereo.run.mean_features, 150.0);
  EXPECT_LT(stereo.rmse_m, 0.03);
  EXPECT_LT(stereo.nees_position, 12.0);
}

// A motion capture's heights count from its floor.
TEST(DatasetRun, CountsDepthFromTheTruthsLevel) {
  auto dataset = read_asl_dataset(recording());
  ASSERT_TRUE(dataset) << dataset.error();
  for (TruePose& pose : dataset->truth) pose.X_WB.p.z() += 7.0;
  const Judged shifted = judged({}, *dataset);
  EXPECT_LT(shifted.rmse_m, 0.05);
  EXPECT_LT(shifted.nees_position, 12.0);
  EXPECT_THAT(shifted.run.diagnostics.list(),
              ::testing::Contains(::testing::Field(&Diagnostic::code, "DEPTH-DATUM")));
}

TEST(DatasetRun, LocalisesThroughLensesOf120Degrees) {
  const std::string folder =
      record({testing::wide_camera(0.06, 376, 282), testing::wide_camera(-0.06, 376, 282)});
  const Judged stereo = judged({}, folder);
  EXPECT_EQ(stereo.run.health.images.rejected(), 0) << stereo.run.health.images.last;
  EXPECT_EQ(stereo.run.health.failure, "");
  EXPECT_TRUE(stereo.run.health.restarts.empty());
  EXPECT_GT(stereo.run.mean_features, 150.0);
  EXPECT_LT(stereo.rmse_m, 0.03);
  EXPECT_LT(stereo.nees_position, 12.0);
}

TEST(DatasetRun, LocalisesWithOneCameraFromTheTruth) {
  RunOptions options;
  options.mono = true;
  options.start = RunStart::kTruth;
  const Judged mono = judged(options);
  EXPECT_GT(mono.run.estimates.size(), 78U);
  EXPECT_LT(mono.rmse_m, 0.06);
}

// It stands still at first; a speed that is expected does not mislead it.
TEST(DatasetRun, BeginsAtRestInSpiteOfAnExpectedSpeed) {
  RunOptions options;
  options.speed = 0.4;
  const Judged stereo = judged(options);
  EXPECT_EQ(stereo.run.waits_for, "");
  EXPECT_LT(stereo.run.began_s, 0.7);
  EXPECT_LT(stereo.rmse_m, 0.06);
}

// It expects 0.2 m/s all the time.
TEST(DatasetRun, DeadReckonsWithThePrimitiveEstimator) {
  RunOptions options;
  options.estimator = EstimatorKind::kPrimitive;
  options.speed = 0.2;
  const Judged primitive = judged(options);
  EXPECT_GT(primitive.run.estimates.size(), 75U);
  EXPECT_GT(primitive.rmse_m, 0.05);
  EXPECT_LT(primitive.rmse_m, 0.6);
}

// Measured velocities take the place of an expected speed that is wrong. In a vehicle that
// accelerates, a velocity of five times a second is a tenth of a second old.
TEST(DatasetRun, DeadReckonsWithMeasuredVelocities) {
  RunOptions options;
  options.estimator = EstimatorKind::kPrimitive;
  options.speed = 0.2;
  const double expected_m = judged(options).rmse_m;
  auto dataset = read_asl_dataset(recording());
  ASSERT_TRUE(dataset);
  add_velocities(*dataset);
  EXPECT_LT(judged(options, *dataset).rmse_m, 0.5 * expected_m);
}

// A second of darkness, in which the filter is told its speed.
TEST(DatasetRun, UsesMeasuredVelocitiesInTheDark) {
  auto dataset = read_asl_dataset(recording());
  ASSERT_TRUE(dataset);
  darken(*dataset, 2.0, 3.0);
  const Judged blind = judged({}, *dataset);
  EXPECT_NEAR(blind.run.health.images.dark, 20, 1);
  EXPECT_EQ(blind.run.health.images.rejected(), blind.run.health.images.dark);
  EXPECT_NE(blind.run.health.images.last, "");
  EXPECT_TRUE(blind.run.health.restarts.empty());
  EXPECT_LT(blind.run.health.trusted, static_cast<int>(blind.run.estimates.size()));
  add_velocities(*dataset);
  const Judged told = judged({}, *dataset);
  EXPECT_LT(horizontal_sigma(told.run.estimates[50]), horizontal_sigma(blind.run.estimates[50]));
  EXPECT_EQ(told.run.health.inputs.speed_refused, 0);
}

// The gap is long enough for a new start, which half a second later is there.
TEST(DatasetRun, BeginsAgainAfterALongGapOfTheImu) {
  auto dataset = read_asl_dataset(recording());
  ASSERT_TRUE(dataset);
  std::erase_if(dataset->imu, [](const ImuSample& sample) {
    const double t = to_seconds(sample.utime) - kStart;
    return t > 1.5 && t < 2.7;
  });
  RunOptions options;
  options.start = RunStart::kTruth;
  const Judged stereo = judged(options, *dataset);
  const RunHealth& health = stereo.run.health;
  ASSERT_EQ(health.restarts.size(), 1U);
  EXPECT_THAT(health.restarts[0].reason, HasSubstr("no IMU samples for 1.2"));
  EXPECT_NEAR(to_seconds(health.restarts[0].utime - stereo.run.begin), 2.7, 0.1);
  EXPECT_EQ(health.failure, "") << "the filter has not failed";
  EXPECT_EQ(stereo.run.waits_for, "");
  EXPECT_GT(to_seconds(stereo.run.estimates.back().utime) - kStart, 3.9);
  EXPECT_GE(health.starting, 9) << "images that it waited for";
  EXPECT_NEAR(health.late, 23, 2) << "images in the gap";
  for (std::size_t i = 1; i < stereo.run.estimates.size(); ++i) {
    EXPECT_GT(stereo.run.estimates[i].utime, stereo.run.estimates[i - 1].utime) << i;
  }
  EXPECT_LT(stereo.nees_position, 12.0);
}

// An accelerometer that errs by 6 g for a fifth of a second, half a second before the end.
TEST(DatasetRun, StatesAFailureAfterWhichNoEstimateIsTrusted) {
  auto dataset = read_asl_dataset(recording());
  ASSERT_TRUE(dataset);
  for (ImuSample& sample : dataset->imu) {
    const double t = to_seconds(sample.utime) - kStart;
    if (t > 3.4 && t < 3.6) sample.accel_B.x() += 60.0;
  }
  const RunHealth health = judged({}, *dataset).run.health;
  EXPECT_THAT(health.failure, HasSubstr("the filter has diverged: a speed of "));
  ASSERT_EQ(health.restarts.size(), 1U);
  EXPECT_TRUE(health.restarts[0].has_failed);
  EXPECT_EQ(health.restarts[0].reason, health.failure);
}

TEST(DatasetRun, DoesTheSameTwice) {
  const Judged a = judged({});
  const Judged b = judged({});
  ASSERT_EQ(a.run.estimates.size(), b.run.estimates.size());
  EXPECT_EQ(a.rmse_m, b.rmse_m);
}

// No place is revisited in four seconds: there are keyframes, and the estimate stays the filter's.
TEST(DatasetRun, ClosesLoopsAndDoesNotChangeTheFilter) {
  RunOptions options;
  options.loops = true;
  const Judged stereo = judged(options);
  EXPECT_GE(stereo.run.keyframes, 2);
  EXPECT_TRUE(stereo.run.closures.empty());
  EXPECT_EQ(stereo.run.loop_ms.size(), static_cast<std::size_t>(stereo.run.keyframes));
  ASSERT_EQ(stereo.run.corrected.size(), stereo.run.estimates.size());
  EXPECT_EQ(stereo.run.corrected.back().X_WB.p, stereo.run.estimates.back().X_WB.p);

  const auto dataset = read_asl_dataset(recording());
  SteadyClock clock;
  options.mono = true;
  EXPECT_FALSE(run_on(*dataset, options, clock, [](double) {}));
  options.mono = false;
  options.estimator = EstimatorKind::kPrimitive;
  EXPECT_FALSE(run_on(*dataset, options, clock, [](double) {}));
}

TEST(DatasetRun, ReportsWhatARecordingLacks) {
  auto dataset = read_asl_dataset(recording());
  ASSERT_TRUE(dataset);
  SteadyClock clock;
  const auto nothing = [](double) {};
  RunOptions options;
  options.speed = 30.0;
  EXPECT_THAT(run_on(*dataset, options, clock, nothing).error(), HasSubstr("30 m/s"));
  options = {};
  options.start = RunStart::kTruth;
  Recording blind = *dataset;
  blind.has_true_attitude = false;
  EXPECT_THAT(run_on(blind, options, clock, nothing).error(), HasSubstr("no true poses"));
  Recording torn = *dataset;
  for (RecordedImage& image : torn.cameras[0].images) image.path = "/nowhere.png";
  EXPECT_THAT(run_on(torn, {}, clock, nothing).error(),
              HasSubstr("no image can be read; the first: /nowhere.png"));
}

// As in a dive: a fault of each, and the others are used.
TEST(DatasetRun, LeavesOutImagesThatCannotBeRead) {
  auto dataset = read_asl_dataset(recording());
  ASSERT_TRUE(dataset);
  for (const std::size_t i : {30U, 31U, 80U}) dataset->cameras[0].images[i].path = "/nowhere.png";
  dataset->cameras[1].images[40].path = "/neither.png";
  const Judged stereo = judged({}, *dataset);
  EXPECT_EQ(stereo.run.health.images.bad, 3);
  EXPECT_EQ(stereo.run.health.images.right_unused, 1);
  EXPECT_THAT(stereo.run.health.images.last, HasSubstr("/nowhere.png"));
  EXPECT_EQ(stereo.run.health.failure, "");
  EXPECT_LT(stereo.rmse_m, 0.03);
  std::string text;
  for (const Diagnostic& d : stereo.run.diagnostics.list()) text += render(d, false);
  EXPECT_THAT(text, HasSubstr("cam0/data.csv: warning: 3 image(s) cannot be read, and are left "
                              "out; the first: /nowhere.png: no such file"));
  EXPECT_THAT(text, HasSubstr("cam1/data.csv: warning: 1 image(s) cannot be read, and the left"));
}

// A clock that was set while recording: years pass between two images.
TEST(DatasetRun, OutlivesAClockThatJumps) {
  auto dataset = read_asl_dataset(recording());
  ASSERT_TRUE(dataset);
  const auto jump = [](auto& samples) {
    for (auto& sample : samples) {
      if (to_seconds(sample.utime) - kStart > 2.0) sample.utime += 1'600'000'000'000'000;
    }
  };
  jump(dataset->imu);
  jump(dataset->depth);
  jump(dataset->truth);
  for (RecordedCamera& camera : dataset->cameras) jump(camera.images);
  const Judged stereo = judged({}, *dataset);
  EXPECT_EQ(stereo.run.frames, 81);
  EXPECT_EQ(stereo.run.health.restarts.size(), 1U);
}

// Truth that begins two seconds after the images scores the run, and does not shorten it.
TEST(DatasetRun, BeginsBeforeTheTruth) {
  auto dataset = read_asl_dataset(recording());
  ASSERT_TRUE(dataset);
  std::erase_if(dataset->truth,
                [](const TruePose& pose) { return to_seconds(pose.utime) - kStart < 2.0; });
  for (TruePose& pose : dataset->truth) {
    pose.X_WB = Pose{{5.0, -3.0, 1.0}, from_rpy(0.0, 0.0, 2.0)} * pose.X_WB;
  }
  const Judged stereo = judged({}, *dataset);
  EXPECT_EQ(stereo.run.frames, 81);
  EXPECT_LT(to_seconds(stereo.run.estimates.front().utime) - kStart, 1.0);
  EXPECT_LT(stereo.rmse_m, 0.04) << "in the frame of the truth";
  EXPECT_LT(stereo.nees_position, 12.0);
  EXPECT_TRUE(stereo.run.diagnostics.list().empty());

  RunOptions from_truth;
  from_truth.start = RunStart::kTruth;
  const Judged later = judged(from_truth, *dataset);
  EXPECT_EQ(later.run.frames, 41);
  ASSERT_EQ(later.run.diagnostics.list().size(), 2U);
  EXPECT_THAT(later.run.diagnostics.list()[0].message, HasSubstr("40 image(s) before the start"));
  EXPECT_EQ(later.run.diagnostics.list()[1].code, "DEPTH-DATUM");
}

}  // namespace
}  // namespace dive::estimation
