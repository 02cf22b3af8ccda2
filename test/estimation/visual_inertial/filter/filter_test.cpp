// The filter on dives in closed form: consistency, calibration, initialisation, darkness, marine
// snow.

#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/assert.h"
#include "estimation/visual_inertial/filter/visual_inertial_filter.h"
#include "test/common/sanitizers.h"
#include "test/estimation/visual_inertial/filter/filter_dive.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;
using testing::AnalyticDive;
using testing::AnalyticDiveOptions;
using testing::ErrorSample;
using testing::filter_options;
using testing::FilterDiveResult;
using testing::Hooks;
using testing::known_start;
using testing::run;

struct Consistency {
  double nees_position = 0.0;
  double nees_attitude = 0.0;
  double worst_position = 0.0;
  double innovation_ratio = 0.0;
};

// The errors at the end of short dives: one draw each. `dark`: first and last second without
// images.
Consistency ends(const AnalyticDiveOptions& options, int runs, double seconds,
                 const std::array<double, 2>& dark = {1e9, 1e9}) {
  Consistency mean;
  for (int i = 0; i < runs; ++i) {
    const auto seed = static_cast<std::uint64_t>(200 + i);
    AnalyticDive dive(options, seed);
    Random random(seed, 1);
    const double begin = random.uniform(0.0, 250.0);
    VisualInertialFilter filter(filter_options(dive, options), known_start(dive, begin, random));
    Hooks hooks;
    hooks.has_frame = [&](double t) { return t < begin + dark[0] || t > begin + dark[1]; };
    const FilterDiveResult result = run(dive, options, filter, begin, begin + seconds, hooks);
    EXPECT_FALSE(filter.health().diverged) << filter.health().reason;
    const ErrorSample& last = result.errors.back();
    mean.nees_position += last.nees_position / runs;
    mean.nees_attitude += last.nees_attitude / runs;
    mean.worst_position = std::max(mean.worst_position, last.position.norm());
    mean.innovation_ratio += filter.health().visual_innovation_ratio / runs;
  }
  return mean;
}

// Bounds for 36 degrees of freedom: 99 % of the means of twelve three-dimensional NEES are within.
constexpr double kLeastNees = 1.49;
constexpr double kMostNees = 5.14;

void expect_consistent(const Consistency& mean) {
  EXPECT_GT(mean.nees_position, kLeastNees);
  EXPECT_LT(mean.nees_position, kMostNees);
  EXPECT_GT(mean.nees_attitude, kLeastNees);
  EXPECT_LT(mean.nees_attitude, kMostNees);
}

TEST(Consistency, CovarianceIsConsistentInStereo) {
  DIVE_SKIP_UNDER_SANITIZERS("a law of many dives, each of whose steps other tests take");
  const Consistency mean = ends({}, 12, 20.0);
  expect_consistent(mean);
  EXPECT_LT(mean.worst_position, 0.15);
}

// With one sigma of n for the whole image the ratio of the innovations is 1.15, and the worst error
// 0.19 m.
TEST(Consistency, CovarianceIsConsistentThroughAnEquidistantLens) {
  DIVE_SKIP_UNDER_SANITIZERS("a law of many dives, each of whose steps other tests take");
  AnalyticDiveOptions options;
  options.lens = LensModel::kEquidistant;
  const Consistency mean = ends(options, 12, 20.0);
  EXPECT_NEAR(mean.innovation_ratio, 0.97, 0.08);  // the gate takes the tail away
  expect_consistent(mean);
  EXPECT_LT(mean.worst_position, 0.15);
}

TEST(Consistency, CovarianceIsConsistentInMonoAt50Hz) {
  DIVE_SKIP_UNDER_SANITIZERS("a law of many dives, each of whose steps other tests take");
  AnalyticDiveOptions options;
  options.is_stereo = false;
  options.imu_hz = 50.0;
  const Consistency mean = ends(options, 12, 20.0);
  expect_consistent(mean);
  EXPECT_LT(mean.worst_position, 0.25);
}

TEST(Consistency, CovarianceIsConsistentWithARollingShutter) {
  DIVE_SKIP_UNDER_SANITIZERS("a law of many dives, each of whose steps other tests take");
  AnalyticDiveOptions options;
  options.line_time_s = 4e-5;  // 19 ms for an image
  const Consistency mean = ends(options, 12, 20.0);
  expect_consistent(mean);
  EXPECT_LT(mean.worst_position, 0.15);
}

struct Dived {
  AnalyticDiveOptions options;
  AnalyticDive dive;
  Random random{11};
  VisualInertialFilter filter;
  explicit Dived(const AnalyticDiveOptions& of = {}, std::uint64_t seed = 21)
      : options(of),
        dive(options, seed),
        filter(filter_options(dive, options), known_start(dive, 0.0, random)) {}
  FilterDiveResult go(double begin, double end, const Hooks& hooks = {}) {
    return run(dive, options, filter, begin, end, hooks);
  }
};

TEST(Calibration, FindsOffsetAndCamerasAndBiases) {
  AnalyticDiveOptions options;
  options.time_offset_sigma_s = 0.01;
  options.gyro_by_accel_sigma = 0.0;  // or it is part of the gyro's bias
  Dived d(options, 22);
  ASSERT_GT(std::abs(d.dive.true_time_offset_s()), 0.004) << "or there is nothing to find";
  auto filter_settings = filter_options(d.dive, options);
  filter_settings.time_offset_sigma_s = 0.01;
  VisualInertialFilter filter(filter_settings, known_start(d.dive, 0.0, d.random));
  static_cast<void>(run(d.dive, options, filter, 0.0, 40.0));
  const FilterState& state = filter.state();
  EXPECT_NEAR(state.time_offset_s, d.dive.true_time_offset_s(), 0.001);
  EXPECT_LT((state.imu.gyro_bias - d.dive.gyro_bias()).norm(), 0.0005);
  const auto stereo = [](const Pose& a, const Pose& b) {
    return rad_to_deg(so3_log(a.q.conjugate() * b.q).norm());
  };
  const auto& truth = d.dive.true_cameras();
  const double told_off =
      std::abs(stereo(filter_settings.cameras[0].X_BC, filter_settings.cameras[1].X_BC) -
               stereo(truth[0].X_BC, truth[1].X_BC));
  const Pose error = (state.cameras_B[0].inverse() * state.cameras_B[1]).inverse() *
                     (truth[0].X_BC.inverse() * truth[1].X_BC);
  EXPECT_GT(told_off, 0.1);
  EXPECT_LT(rad_to_deg(so3_log(error.q).norm()), 0.03) << "of one camera to the other";
}

TEST(Calibration, IsLeftOutWhereItIsSwitchedOff) {
  AnalyticDiveOptions options;
  options.extrinsic_sigma_deg = options.extrinsic_sigma_m = options.time_offset_sigma_s = 0.0;
  options.imu_scale_sigma = 0.0;
  AnalyticDive dive(options, 5);
  auto of = filter_options(dive, options);
  of.calibrate_extrinsics = of.calibrate_time_offset = false;
  of.max_landmarks = 0;
  Random random(5);
  VisualInertialFilter filter(of, known_start(dive, 0.0, random));
  const auto result = run(dive, options, filter, 0.0, 15.0);
  EXPECT_LT(result.errors.back().position.norm(), 0.1);
  EXPECT_EQ(filter.state().size(), 15 + 6 * (of.max_clones - 1));
  EXPECT_EQ(filter.state().cameras_B[0].p, dive.cameras()[0].X_BC.p);
}

// Calibrated in air, and in water whose index is known to 0.015: a sea or a lake, cold or warm.
TEST(Calibration, FindsTheRefractiveIndexBehindAFlatPort) {
  AnalyticDiveOptions options;
  options.refractive_index = 1.335;
  options.refractive_index_sigma = 0.015;
  for (const std::uint64_t seed : {31, 32, 33}) {
    Dived d(options, seed);
    const auto result = d.go(0.0, 60.0);
    const double truth = d.dive.true_cameras()[0].refractive_index;
    const FilterState& state = d.filter.state();
    EXPECT_NEAR(state.models[0].refractive_index, truth, 0.005) << seed;
    const Eigen::Index at = state.refractive_index_columns()->start;
    EXPECT_LT(std::sqrt(state.covariance()(at, at)), 0.3 * options.refractive_index_sigma);
    EXPECT_LT(result.errors.back().nees_position, 16.3) << seed;
    EXPECT_LT(result.errors.back().nees_attitude, 16.3) << seed;
  }
}

TEST(Calibration, FindsFocalLengthsAndPrincipalPoints) {
  AnalyticDiveOptions options;
  options.focal_sigma = 0.01;
  options.centre_sigma_px = 2.0;
  Dived d(options, 34);
  const auto result = d.go(0.0, 60.0);
  const FilterState& state = d.filter.state();
  for (std::size_t i = 0; i < 2; ++i) {
    const CameraModel& told = d.dive.cameras()[i];
    const CameraModel& truth = d.dive.true_cameras()[i];
    const CameraModel& found = state.models[i];
    const Eigen::Vector4d error(found.fx - truth.fx, found.fy - truth.fy, found.cx - truth.cx,
                                found.cy - truth.cy);
    const auto sigmas = state.covariance()
                            .diagonal()
                            .segment<4>(state.camera_intrinsics_columns(i)->start)
                            .cwiseSqrt()
                            .eval();
    EXPECT_LT(error.cwiseQuotient(sigmas).cwiseAbs().maxCoeff(), 4.0) << error.transpose();
    EXPECT_LT(sigmas.head<2>().maxCoeff(), 0.3 * options.focal_sigma * told.fx);
  }
  EXPECT_LT(result.errors.back().nees_position, 16.3);
}

// Turns of a dive show the gyro's scale; without it in the state they would be errors of attitude.
TEST(Calibration, FindsTheGyrosScale) {
  AnalyticDiveOptions options;
  options.imu_scale_sigma = 0.02;
  Dived d(options, 24);
  const auto result = d.go(0.0, 120.0);
  const FilterState& state = d.filter.state();
  const Columns columns = *state.imu_intrinsics_columns();
  const Eigen::Index about_up = columns.start + 8;
  const double sigma = std::sqrt(state.covariance()(about_up, about_up));
  EXPECT_LT(sigma, 0.3 * options.imu_scale_sigma);
  // omega = (I + T) (gyro - b) and gyro - b = S omega
  const double expected = d.dive.gyro_scale().inverse()(2, 2) - 1.0;
  EXPECT_NEAR(state.imu.intrinsics.gyro(2, 2), expected, 4.0 * sigma);
  EXPECT_LT(result.errors.back().nees_attitude, 16.0);
}

// A start from images, with errors of position and heading within their sigmas.
ImageStart start_near(const AnalyticDive& dive, double t) {
  ImageStart start;
  const Pose truth = dive.truth(t).X_WB;
  start.position_W = truth.p + Vector3d(0.05, -0.05, 0.05);
  start.heading = so3_exp({0.0, 0.0, deg_to_rad(0.7)}) * truth.q;
  return start;
}

struct Began {
  double after_s = -1.0;
  Vector3d velocity_error = Vector3d::Zero();  // m/s, in W
  std::string waited_for;                      // just before
  ErrorSample end;
};

Began begin_from_images(AnalyticDive& dive, const AnalyticDiveOptions& options,
                        const ImageStart& start, double t, double seconds, Hooks hooks = {}) {
  VisualInertialFilter filter(filter_options(dive, options), start);
  Began began;
  hooks.each_tick = [&](double now, VisualInertialFilter& f) {
    if (began.after_s >= 0.0) return;
    if (f.state_frames() == 0) {
      if (!f.health().waits_for.empty()) began.waited_for = f.health().waits_for;
      return;
    }
    began.after_s = now - t;
    const auto truth = dive.truth(now);
    began.velocity_error = f.state().imu.motion.v_WB - truth.X_WB.q * truth.v_WB_B;
  };
  const auto result = run(dive, options, filter, t, t + seconds, hooks);
  EXPECT_FALSE(filter.health().diverged) << filter.health().reason;
  if (!result.errors.empty()) began.end = result.errors.back();
  return began;
}

// One camera or two, four speeds, biases of MEMS units: no seed was chosen.
TEST(Start, FromImagesIsRightAtRestAndInMotion) {
  for (const bool is_stereo : {true, false}) {
    for (const double speed : {0.0, 0.1, 0.4}) {
      for (const std::uint64_t seed : {31U, 32U, 33U}) {
        SCOPED_TRACE(fmt::format("stereo {}, {} m/s, seed {}", is_stereo, speed, seed));
        AnalyticDiveOptions options;
        options.speed = speed;
        options.is_stereo = is_stereo;
        AnalyticDive dive(options, seed);
        const double t = 10.0 * static_cast<double>(seed);
        const Began began = begin_from_images(dive, options, start_near(dive, t), t, 5.0);
        ASSERT_GE(began.after_s, 0.0) << began.waited_for;
        EXPECT_LT(began.after_s, is_stereo ? 0.8 : 3.0);
        EXPECT_LT(began.velocity_error.norm(), 0.2);
        EXPECT_LT(began.end.position.norm(), 0.8);
        EXPECT_LT(rad_to_deg(began.end.attitude), 5.0);
        EXPECT_LT(began.end.nees_position, 25.0);
      }
    }
  }
}

// At rest and at constant speed the tilt cannot be told from the accelerometer's bias, whatever two
// cameras see: no landmark may make it certain.
TEST(Start, FromImagesStaysUncertainOfTheTiltAtRestAndAtConstantSpeed) {
  constexpr int kDives = 8;
  for (const double speed : {0.0, 0.1}) {
    double nees = 0.0;
    for (std::uint64_t seed = 41; seed < 41 + kDives; ++seed) {
      AnalyticDiveOptions options;
      options.speed = speed;
      AnalyticDive dive(options, seed);
      const double t = 10.0 * static_cast<double>(seed);
      const Began began = begin_from_images(dive, options, start_near(dive, t), t, 4.0);
      ASSERT_GE(began.after_s, 0.0) << began.waited_for;
      nees += began.end.nees_attitude / kDives;
    }
    EXPECT_GT(nees, 0.5) << speed;
    EXPECT_LT(nees, 5.0) << speed;  // of 3; 97.5 % of so many dives
  }
}

TEST(Start, FromImagesOfARollingShutterIsRightToo) {
  AnalyticDiveOptions options;
  options.line_time_s = 6e-5;  // 29 ms for an image
  for (const std::uint64_t seed : {36U, 37U, 38U}) {
    AnalyticDive dive(options, seed);
    const double t = 10.0 * static_cast<double>(seed);
    const Began began = begin_from_images(dive, options, start_near(dive, t), t, 5.0);
    ASSERT_GE(began.after_s, 0.0) << began.waited_for;
    EXPECT_LT(began.after_s, 0.8);
    EXPECT_LT(began.velocity_error.norm(), 0.1);
    EXPECT_LT(began.end.nees_position, 16.3);
    EXPECT_LT(began.end.nees_attitude, 16.3);
  }
}

// The expected speed of a gait is known to 0.1 m/s: better than nothing, and no images of one
// camera at constant velocity improve it.
TEST(Start, FromImagesIsImmediateWithOneCameraWhereTheSpeedIsKnown) {
  AnalyticDiveOptions options;
  options.is_stereo = false;
  for (const double sigma : {0.03, 0.1}) {
    AnalyticDive dive(options, 34);
    ImageStart start = start_near(dive, 20.0);
    const Vector3d error = sigma * Vector3d(0.7, 0.3, -0.7);
    start.speed = ImageStart::Speed{dive.truth(20.0).v_WB_B + error, sigma, from_seconds(20.0)};
    const Began began = begin_from_images(dive, options, start, 20.0, 10.0);
    EXPECT_GE(began.after_s, 0.0) << began.waited_for;
    EXPECT_LT(began.after_s, 0.7);
    EXPECT_LT(began.velocity_error.norm(), 3.0 * sigma);
    EXPECT_LT(began.end.nees_position, 16.3);
    EXPECT_LT(began.end.nees_attitude, 16.3);
  }
}

// A depth sensor that begins late, within the images of the start or after it: until then the
// height is that of nothing in particular.
TEST(Start, FromImagesTakesTheHeightOfTheFirstDepthSample) {
  for (const double silent_s : {0.3, 3.0}) {
    AnalyticDiveOptions options;
    AnalyticDive dive(options, 39);
    ImageStart start = start_near(dive, 20.0);
    start.position_W.z() += 5.0;
    Hooks hooks;
    hooks.spoil_depth = [&](double t, DepthSample& sample) {
      if (t < 20.0 + silent_s) sample.depth_m = std::numeric_limits<double>::quiet_NaN();
    };
    const Began began = begin_from_images(dive, options, start, 20.0, 8.0, hooks);
    ASSERT_GE(began.after_s, 0.0) << began.waited_for;
    EXPECT_LT(std::abs(began.end.position.z()), 0.1) << silent_s;
    EXPECT_LT(began.end.nees_position, 16.3);
    EXPECT_LT(began.end.nees_attitude, 16.3);
  }
}

// Position and heading were known before twelve seconds of darkness, in which the vehicle turned.
TEST(Start, FromImagesFollowsTheHeadingThroughTheDark) {
  AnalyticDiveOptions options;
  AnalyticDive dive(options, 40);
  ImageStart start = start_near(dive, 20.0);
  start.utime = from_seconds(20.0);
  start.bias = {dive.gyro_bias(), dive.accel_bias(), 0.002, 0.02};
  Hooks hooks;
  hooks.has_frame = [](double t) { return t > 32.0; };
  const Began began = begin_from_images(dive, options, start, 20.0, 16.0, hooks);
  ASSERT_GE(began.after_s, 12.0) << began.waited_for;
  EXPECT_LT(rad_to_deg(began.end.attitude), 4.0);
  EXPECT_LT(began.end.nees_attitude, 16.3);
  EXPECT_LT(began.end.nees_position, 16.3);
}

TEST(Start, FromImagesWaitsInTheDarkAndSaysSo) {
  AnalyticDiveOptions options;
  AnalyticDive dive(options, 35);
  VisualInertialFilter filter(filter_options(dive, options), start_near(dive, 0.0));
  Hooks hooks;
  hooks.has_frame = [](double t) { return t > 3.0; };
  std::string in_the_dark;
  hooks.each_tick = [&](double t, VisualInertialFilter& f) {
    if (t < 2.9) in_the_dark = f.health().waits_for;
  };
  const auto result = run(dive, options, filter, 0.0, 6.0, hooks);
  EXPECT_EQ(in_the_dark, "images");
  EXPECT_EQ(filter.health().waits_for, "");
  ASSERT_FALSE(result.errors.empty());
  EXPECT_GT(result.errors.front().t, 3.0);
}

TEST(Start, WithoutImagesNeverBegins) {
  AnalyticDiveOptions options;
  AnalyticDive dive(options, 36);
  VisualInertialFilter filter(filter_options(dive, options), ImageStart{});
  Hooks hooks;
  hooks.has_frame = [](double) { return false; };
  EXPECT_TRUE(run(dive, options, filter, 0.0, 3.0, hooks).errors.empty());
  EXPECT_FALSE(filter.update(4'000'000).valid);
}

TEST(Start, AgainKeepsTheCalibration) {
  Dived d;
  static_cast<void>(d.go(0.0, 10.0));
  const double offset = d.filter.state().time_offset_s;
  EXPECT_NE(offset, 0.0);
  d.filter.restart(known_start(d.dive, 10.5, d.random));
  EXPECT_EQ(d.filter.state().time_offset_s, offset);
  const auto result = d.go(10.005, 20.0);
  EXPECT_LT(result.errors.back().position.norm(), 0.1);
  EXPECT_FALSE(d.filter.health().diverged) << d.filter.health().reason;
}

TEST(Darkness, CostsWhatTheCovarianceAllowsAndIsReported) {
  AnalyticDiveOptions options;
  options.speed = 0.25;
  Dived d(options, 41);
  Hooks hooks;
  hooks.has_frame = [](double t) { return t < 20.0 || t > 27.0; };
  bool was_blind = false;
  double sigma_before = 0.0;
  double sigma_dark = 0.0;
  double most_jump = 0.0;
  Vector3d last = Vector3d::Zero();
  hooks.each_tick = [&](double t, VisualInertialFilter& f) {
    const StateEstimate& estimate = f.update(from_seconds(t));
    if (!estimate.valid) return;
    if (t < 20.0) sigma_before = horizontal_sigma(estimate);
    if (t < 27.0) sigma_dark = horizontal_sigma(estimate);
    if (t > 22.0 && t < 27.0) was_blind = was_blind || f.health().is_blind;
    if (t > 27.0 && t < 28.0) most_jump = std::max(most_jump, (estimate.X_WB.p - last).norm());
    last = estimate.X_WB.p;
  };
  const auto result = d.go(0.0, 35.0, hooks);
  EXPECT_TRUE(was_blind);
  EXPECT_FALSE(d.filter.health().is_blind);
  EXPECT_FALSE(d.filter.health().diverged) << d.filter.health().reason;
  EXPECT_LT(result.errors.back().position.norm(), 0.4);
  EXPECT_LT(result.errors.back().nees_position, 16.0);
  EXPECT_GT(sigma_dark, 2.0 * sigma_before) << "the covariance grows without images";
  EXPECT_LT(most_jump, 4.0 * sigma_dark);
}

// The points that return have the ids that they had before: with tracks and landmarks continued
// across the darkness the NEES of the position was 9.8.
TEST(Darkness, LeavesTheCovarianceConsistent) {
  DIVE_SKIP_UNDER_SANITIZERS("a law of many dives, each of whose steps other tests take");
  AnalyticDiveOptions options;
  options.speed = 0.25;
  const Consistency mean = ends(options, 12, 30.0, {20.0, 27.0});
  expect_consistent(mean);
}

// With one camera the speed is poorly known after it: corrected in full by rows that are not linear
// that far, the NEES of the position was 25.
TEST(Darkness, LeavesTheCovarianceConsistentWithOneCamera) {
  DIVE_SKIP_UNDER_SANITIZERS("a law of many dives, each of whose steps other tests take");
  AnalyticDiveOptions options;
  options.speed = 0.25;
  options.is_stereo = false;
  const Consistency mean = ends(options, 12, 45.0, {20.0, 30.0});
  expect_consistent(mean);
}

TEST(Darkness, IsBoundedByAnExpectedSpeed) {
  AnalyticDiveOptions options;
  options.speed = 0.25;
  double sigma[2];
  for (const bool knows_speed : {false, true}) {
    Dived d(options, 42);
    Hooks hooks;
    hooks.has_frame = [](double t) { return t < 5.0; };
    hooks.each_tick = [&](double t, VisualInertialFilter& f) {
      const bool is_tenth = std::llround(t * 200.0) % 20 == 0;
      if (!knows_speed || !is_tenth) return;
      f.add_speed(from_seconds(t), d.dive.truth(t).v_WB_B, Vector3d::Constant(0.1));
    };
    const auto result = d.go(0.0, 25.0, hooks);
    sigma[knows_speed ? 1 : 0] = horizontal_sigma(d.filter.update(26'000'000));
    EXPECT_EQ(d.filter.health().faults.speed_refused, 0);
    EXPECT_LT(result.errors.back().nees_position, 16.0);
  }
  EXPECT_LT(sigma[1], 0.3 * sigma[0]);
}

TEST(Snow, IsKeptOut) {
  AnalyticDiveOptions options;
  options.snow_share = 0.5;
  Dived d(options, 51);
  const auto result = d.go(0.0, 30.0);
  EXPECT_GT(result.used, 2000);
  EXPECT_LT(static_cast<double>(result.used_particles), 0.01 * static_cast<double>(result.used));
  EXPECT_GT(result.snow.size(), 1'000U);
  EXPECT_LT(result.errors.back().position.norm(), 0.2);
  EXPECT_FALSE(d.filter.health().diverged) << d.filter.health().reason;
}

// Nine tracks of ten end with every image, so that of 200 none lasts for four.
TEST(ShortTracks, OfTwoCamerasAreUsedWhereThereAreNoOthers) {
  AnalyticDiveOptions options;
  options.loss_share = 0.9;
  options.frame_hz = 10.0;
  Dived d(options, 61);
  const auto result = d.go(0.0, 15.0);
  EXPECT_GT(result.used, 200);
  EXPECT_LT(result.errors.back().position.norm(), 0.3);
  EXPECT_FALSE(d.filter.health().diverged) << d.filter.health().reason;
  options.is_stereo = false;
  EXPECT_LT(Dived(options, 61).go(0.0, 5.0).used, 50) << "one camera cannot tell them from snow";
}

TEST(Landmarks, LieWithinTheirCovariance) {
  AnalyticDiveOptions options;
  options.depth_bias_sigma_m = 0.0;  // their heights are those by the depth sensor
  Dived d(options);
  double nees = 0.0;
  int count = 0;
  Hooks hooks;
  std::int64_t last = 0;
  hooks.each_tick = [&](double t, VisualInertialFilter& f) {
    if (t < 5.0 || f.state_frames() == last) return;
    last = f.state_frames();
    for (const Landmark& landmark : f.landmarks()) {
      const Vector3d error = landmark.p_W - d.dive.landmark(landmark.id);
      ASSERT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(landmark.covariance)
                    .eigenvalues()
                    .minCoeff(),
                0.0);
      nees += error.dot(landmark.covariance.llt().solve(error));
      ++count;
    }
  };
  static_cast<void>(d.go(0.0, 15.0, hooks));
  ASSERT_GT(count, 1000);
  EXPECT_LT(nees / count, 6.0);
  EXPECT_GT(nees / count, 0.5);
}

TEST(Filter, GivesTheSameBitForBit) {
  Pose last[2];
  for (Pose& pose : last) {
    Dived d;
    static_cast<void>(d.go(0.0, 5.0));
    pose = d.filter.update(6'000'000).X_WB;
  }
  EXPECT_EQ(last[0].p, last[1].p);
  EXPECT_EQ(last[0].q.coeffs(), last[1].q.coeffs());
}

TEST(Filter, PublishesInTheConventionsOfAllEstimators) {
  Dived d;
  static_cast<void>(d.go(0.0, 5.0));
  const StateEstimate& estimate = d.filter.update(5'010'000);
  const auto truth = d.dive.truth(5.01);
  EXPECT_EQ(estimate.source, EstimatorKind::kVisualInertial);
  EXPECT_EQ(estimate.utime, 5'010'000);
  EXPECT_LT((estimate.v_WB_B - truth.v_WB_B).norm(), 0.05);
  EXPECT_LT((estimate.omega_WB_B - truth.omega_WB_B).norm(), 0.03);
  EXPECT_EQ(estimate.covariance, Matrix6d(estimate.covariance.transpose()));
  const Matrix15d P = d.filter.state().covariance().topLeftCorner<15, 15>();
  // Without the variance of the depth sensor's constant error, which the state does not have.
  const double z = estimate.covariance(2, 2) - 0.03 * 0.03;
  EXPECT_NEAR(z / P(imu_error::kPosition + 2, imu_error::kPosition + 2), 1.0, 0.2);
}

TEST(Filter, DemandsOptionsAndStartsThatHold) {
  AnalyticDive dive({}, 1);
  VisualInertialOptions options = filter_options(dive, {});
  EXPECT_EQ(options.validate(), "");
  options.pixel_sigma = std::nan("");
  EXPECT_THAT(options.validate(), ::testing::StartsWith("pixel_sigma is nan"));
  EXPECT_THROW(VisualInertialFilter(options, ImageStart{}), AssertionFailure);
  options = filter_options(dive, {});
  options.cameras.clear();
  EXPECT_THAT(options.validate(), ::testing::HasSubstr("one or two"));
  options = filter_options(dive, {});
  ImageStart start;
  start.speed = ImageStart::Speed{Vector3d::Zero(), 0.0, std::nullopt};
  EXPECT_NE(validate(FilterStart{start}), "");
  EXPECT_THROW(VisualInertialFilter(options, start), AssertionFailure);
  KnownStart known;
  known.X_WB.q.coeffs().setZero();
  EXPECT_THAT(validate(FilterStart{known}), ::testing::HasSubstr("unit quaternion"));
  known = {};
  known.bias.gyro_sigma = -1.0;
  EXPECT_THAT(validate(FilterStart{known}), ::testing::HasSubstr("bias"));
  start = {};
  start.heading.coeffs().setZero();
  EXPECT_NE(validate(FilterStart{start}), "");
}

}  // namespace
}  // namespace dive::estimation
