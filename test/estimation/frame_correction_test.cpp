// The correction from odometry to the map, with an odometry of known errors and estimates of vision
// written here.

#include "estimation/frame_correction.h"

#include <cmath>
#include <functional>
#include <limits>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/assert.h"
#include "common/random.h"
#include "test/common/allocations.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr Utime kTick = 20'000;
constexpr double kDt = 0.02;
constexpr Utime kPeriod = 50'000;
constexpr Utime kLatency = 80'000;

// A vehicle that swims east at 0.4 m/s in water that moves north, with a compass error.
class FrameCorrectionTest : public ::testing::Test {
 protected:
  [[nodiscard]] Vector3d true_position(Utime t) const {
    return Vector3d(0.4, current_, 0.0) * to_seconds(t) - 3.0 * Vector3d::UnitZ();
  }

  [[nodiscard]] StateEstimate odometry() const {
    StateEstimate estimate;
    estimate.utime = now_;
    estimate.valid = true;
    const Eigen::Quaterniond turn = from_rpy(0, 0, compass_off_);
    estimate.X_WB.q = turn;
    estimate.X_WB.p = turn * Vector3d(0.4 * to_seconds(now_), 0.0, -3.0);
    estimate.v_WB_B = Vector3d(0.4, 0.0, 0.0);
    estimate.covariance = 0.01 * Matrix6d::Identity();
    return estimate;
  }

  [[nodiscard]] VisionEstimate update(Utime taken) const {
    VisionEstimate update;
    update.frame_utime = taken;
    update.init_utime = init_utime_;
    update.fault = VisionFault::kNone;
    update.period_s = to_seconds(kPeriod);
    update.estimate.utime = taken;
    update.estimate.valid = true;
    update.estimate.source = EstimatorKind::kVisualInertial;
    update.estimate.X_WB.p = true_position(taken) + vision_off_;
    update.estimate.v_WB_B = Vector3d(0.4, current_, 0.0);
    update.estimate.covariance = 1e-4 * Matrix6d::Identity();
    return update;
  }

  // One tick, with a due update, if vision works.
  const StateEstimate& tick() {
    now_ += kTick;
    if (vision_works_ && now_ >= next_due_) {
      VisionEstimate due = update(next_due_ - kLatency);
      due.fault = vision_fault_;
      correction_.propose(now_, due);
      if (fault_once_) vision_fault_ = VisionFault::kNone;
    }
    while (now_ >= next_due_) next_due_ += kPeriod;
    const Vector3d before = correction_.estimate().X_WB.p;
    const StateEstimate& estimate = correction_.update(odometry());
    if (now_ > kTick) step_ = (estimate.X_WB.p - before).norm();
    largest_step_ = std::max(largest_step_, step_);
    return estimate;
  }

  const StateEstimate& run(double seconds) {
    for (const Utime end = now_ + from_seconds(seconds); now_ < end;) tick();
    return correction_.estimate();
  }

  // Ticks until the source is `source`, at most 5 s; s.
  double until(EstimatorKind source) {
    const Utime begin = now_;
    while (correction_.estimate().source != source && now_ - begin < 5'000'000) tick();
    return to_seconds(now_ - begin);
  }

  [[nodiscard]] double error() const {
    return (correction_.estimate().X_WB.p - true_position(now_)).norm();
  }

  [[nodiscard]] double distance_to_vision() const {
    return (correction_.estimate().X_WB.p - true_position(now_) - vision_off_).norm();
  }

  FrameCorrection correction_{FrameCorrectionOptions{}, PrimitiveOptions{}};
  Utime now_ = 0;
  Utime next_due_ = 100'000;
  double current_ = 0.0;
  double compass_off_ = 0.0;
  Vector3d vision_off_ = Vector3d::Zero();
  Utime init_utime_ = 0;
  bool vision_works_ = true;
  VisionFault vision_fault_ = VisionFault::kNone;
  bool fault_once_ = false;
  double step_ = 0.0;
  double largest_step_ = 0.0;
};

constexpr auto kVision = EstimatorKind::kVisualInertial;
constexpr auto kOdometry = EstimatorKind::kPrimitive;

TEST_F(FrameCorrectionTest, PublishesTheOdometryUntilVisionIsAccepted) {
  vision_works_ = false;
  const StateEstimate& published = run(2.0);
  EXPECT_EQ(published.source, kOdometry);
  EXPECT_EQ(published.X_WB.p, odometry().X_WB.p);
  EXPECT_EQ(published.covariance, odometry().covariance);
  EXPECT_EQ(correction_.fault(), VisionFault::kStarting);
}

TEST_F(FrameCorrectionTest, FollowsVisionInACurrentAndWithACompassBias) {
  current_ = 0.2;
  compass_off_ = deg_to_rad(3.0);
  EXPECT_LT(until(kVision), 0.5);
  run(10.0);
  EXPECT_LT(error(), 0.002);
  const StateEstimate& published = correction_.estimate();
  EXPECT_LT(std::abs(to_rpy(published.X_WB.q).z()), deg_to_rad(0.1));
  EXPECT_NEAR(published.v_WB_B.y(), 0.2, 0.01);
  EXPECT_EQ(correction_.fault(), VisionFault::kNone);
}

// The odometry contains a declared current that is a little off: vision measures the rest.
TEST_F(FrameCorrectionTest, WhatIsUnmodelledContainsTheDeclaredCurrent) {
  correction_.set_current({0.0, 0.3});
  tick();
  EXPECT_EQ(correction_.unmodelled().current_W, Vector2d(0.0, 0.3));
}

TEST_F(FrameCorrectionTest, LosesVisionWithinThreeImagesOfRejectedUpdatesOrSilence) {
  run(10.0);
  vision_fault_ = VisionFault::kDark;
  const Utime dark = now_;
  until(kOdometry);
  EXPECT_LE(to_seconds(now_ - dark), 2.6 * to_seconds(kPeriod));
  EXPECT_EQ(correction_.fault(), VisionFault::kDark);
  vision_fault_ = VisionFault::kNone;
  EXPECT_LT(until(kVision), 0.25);
  run(10.0);
  vision_works_ = false;
  const Utime silent = now_;
  until(kOdometry);
  EXPECT_LE(to_seconds(now_ - silent), 3.0 * to_seconds(kPeriod));
  EXPECT_EQ(correction_.fault(), VisionFault::kNoImages);
}

TEST_F(FrameCorrectionTest, KeepsVisionThroughOneRejectedUpdate) {
  run(3.0);
  fault_once_ = true;
  for (int i = 0; i < 20; ++i) {
    vision_fault_ = VisionFault::kLost;
    run(0.17);
    ASSERT_EQ(correction_.estimate().source, kVision) << i;
  }
}

// The current persists, and its velocity is known.
TEST_F(FrameCorrectionTest, KeepsTheCurrentWithoutVision) {
  current_ = 0.2;
  run(4.0);
  vision_works_ = false;
  run(7.0);
  EXPECT_EQ(correction_.estimate().source, kOdometry);
  EXPECT_LT(error(), 0.15) << "of 1.4 m that it was carried";
  EXPECT_GT(horizontal_sigma(correction_.estimate()), 0.5 * error());
}

TEST_F(FrameCorrectionTest, CovarianceGrowsWithoutVisionAndCoversTheRemainingOffset) {
  run(5.0);
  const double before = horizontal_sigma(correction_.estimate());
  vision_works_ = false;
  double last = before;
  for (int i = 0; i < 10; ++i) {
    const double sigma = horizontal_sigma(run(1.0));
    EXPECT_GT(sigma, last);
    last = sigma;
  }
  vision_off_.y() = 0.5;
  vision_works_ = true;
  until(kVision);
  EXPECT_GT(distance_to_vision(), 0.4);
  EXPECT_GT(horizontal_sigma(correction_.estimate()), 0.4);
  run(5.0);
  EXPECT_LT(distance_to_vision(), 0.01);
  EXPECT_LT(horizontal_sigma(correction_.estimate()), 2.0 * before);
}

// Vision that is lost repeatedly is accepted after ever longer times, because each change costs a
// plan.
TEST_F(FrameCorrectionTest, WaitsLongerForVisionThatWasLostSoon) {
  double last = 0.0;
  for (int i = 0; i < 4; ++i) {
    vision_fault_ = VisionFault::kNone;
    const double waited = until(kVision);
    EXPECT_GE(waited, last - kDt);
    EXPECT_LT(waited, 1.0);
    last = waited;
    vision_fault_ = VisionFault::kFewFeatures;
    until(kOdometry);
  }
  EXPECT_GT(last, 0.5);
  vision_fault_ = VisionFault::kNone;
  until(kVision);
  run(10.0);
  vision_fault_ = VisionFault::kDark;
  until(kOdometry);
  vision_fault_ = VisionFault::kNone;
  EXPECT_LT(until(kVision), 0.25) << "long ago is forgotten";
}

TEST_F(FrameCorrectionTest, RejectsAnImplausibleUpdate) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto after = [&](const std::function<void(VisionEstimate&)>& spoil) {
    FrameCorrection correction(FrameCorrectionOptions{}, PrimitiveOptions{});
    now_ = 0;
    Utime next = 100'000;
    for (; now_ < 2'000'000;) {
      now_ += kTick;
      static_cast<void>(correction.update(odometry()));
      if (now_ < next) continue;
      next += kPeriod;
      VisionEstimate said = update(now_ - kLatency);
      if (now_ > 1'000'000) spoil(said);
      correction.propose(now_, said);
    }
    EXPECT_TRUE(correction.estimate().X_WB.is_finite());
    EXPECT_TRUE(correction.estimate().covariance.allFinite());
    return correction.estimate().source == kVision ? VisionFault::kNone : correction.fault();
  };
  EXPECT_EQ(after([](VisionEstimate&) {}), VisionFault::kNone);
  EXPECT_EQ(after([&](VisionEstimate& w) { w.estimate.X_WB.p.x() = kNan; }),
            VisionFault::kImplausible);
  EXPECT_EQ(after([&](VisionEstimate& w) { w.estimate.covariance(0, 0) = kNan; }),
            VisionFault::kImplausible);
  EXPECT_EQ(after([](VisionEstimate& w) { w.estimate.covariance(1, 1) = -1.0; }),
            VisionFault::kImplausible);
  EXPECT_EQ(after([](VisionEstimate& w) { w.estimate.X_WB.q.coeffs() *= 2.0; }),
            VisionFault::kImplausible);
  EXPECT_EQ(after([](VisionEstimate& w) { w.estimate.v_WB_B.x() = 3.0; }),
            VisionFault::kImplausible);
  EXPECT_EQ(after([](VisionEstimate& w) { w.estimate.X_WB.q = from_rpy(0.5, 0, 0); }),
            VisionFault::kImplausible);
  EXPECT_EQ(after([](VisionEstimate& w) { w.frame_utime = 1'000'000; }), VisionFault::kBadImage);
  EXPECT_EQ(after([](VisionEstimate& w) { w.frame_utime += 1'000'000; }), VisionFault::kBadImage);
  EXPECT_EQ(after([](VisionEstimate& w) { w.frame_utime = 1'900'000 - w.frame_utime; }),
            VisionFault::kBadImage);
  EXPECT_EQ(after([](VisionEstimate& w) { w.estimate.valid = false; }), VisionFault::kStarting);
}

TEST_F(FrameCorrectionTest, RejectsAnOldUpdateAsLate) {
  run(3.0);
  vision_works_ = false;
  const VisionEstimate old = update(now_ - 20'000);
  run(1.0);
  correction_.propose(now_, old);
  EXPECT_EQ(correction_.fault(), VisionFault::kLate);
}

// After a correction by the map, vision does not pull the vehicle back; a filter initialised from
// the published estimate already contains the correction.
TEST_F(FrameCorrectionTest, AnAlignmentMovesTheFrameOfVisionWithIt) {
  run(3.0);
  correction_.propose_alignment({0.0, 0.3});
  run(3.0);
  EXPECT_NEAR(correction_.estimate().X_WB.p.y(), 0.3, 1e-3);
  EXPECT_EQ(correction_.estimate().source, kVision);
  init_utime_ = now_;
  vision_off_.y() = 0.3;
  run(1.0);
  EXPECT_NEAR(correction_.estimate().X_WB.p.y(), 0.3, 1e-3);
  vision_works_ = false;
  const double before = run(1.0).X_WB.p.y();
  correction_.propose_alignment({0.0, -0.2});
  EXPECT_NEAR(run(0.02).X_WB.p.y(), before - 0.2, 0.01) << "in the dark as well";
}

// A loop finds that the vehicle is 0.4 m farther north and that all headings are 5 degrees wrong:
// vision, which continues in its own frame, is seen from there on in the corrected one.
TEST_F(FrameCorrectionTest, ALoopMovesThePoseAndTheFrameOfVisionWithIt) {
  run(3.0);
  const StateEstimate before = correction_.estimate();
  const PlanarTransform by{deg_to_rad(5.0), {0.0, 0.4}};
  correction_.move(by);
  const auto expect_moved = [&] {
    const StateEstimate& published = correction_.estimate();
    EXPECT_LT((published.X_WB.p - by * true_position(now_)).norm(), 1e-3);
    EXPECT_NEAR(to_rpy(published.X_WB.q).z(), by.yaw, 1e-6);
    EXPECT_LT((odometry_pose(published).p - odometry().X_WB.p).norm(), 1e-9);
    EXPECT_NEAR(published.v_WB_B.x(), 0.4, 1e-3) << "it swims as before, in B";
  };
  tick();
  expect_moved();
  EXPECT_TRUE(correction_.has_jumped());
  EXPECT_NEAR(correction_.estimate().covariance.trace(), before.covariance.trace(), 1e-3);
  run(3.0);
  expect_moved();
  EXPECT_EQ(correction_.estimate().source, kVision);
  EXPECT_FALSE(correction_.has_jumped());
  vision_works_ = false;
  run(2.0);
  EXPECT_LT((correction_.estimate().X_WB.p - by * true_position(now_)).norm(), 0.01);
  correction_.move({0.0, {0.05, 0.0}});
  tick();
  EXPECT_FALSE(correction_.has_jumped()) << "the path need not be planned again";
  EXPECT_LT((correction_.estimate().X_WB.p - by * true_position(now_)).norm(), 0.06);
}

// The odometry reports rest, while the vehicle slides north at 0.1 m/s by ten alignments a second.
TEST_F(FrameCorrectionTest, LearnsASlideFromAlignmentsWithoutIntegratingIt) {
  vision_works_ = false;
  StateEstimate odometry = this->odometry();
  odometry.v_WB_B.setZero();
  odometry.X_WB.q = from_rpy(0, 0, deg_to_rad(90.0));
  const auto rest = [&](double seconds) {
    for (const Utime end = odometry.utime + from_seconds(seconds); odometry.utime < end;) {
      odometry.utime += kTick;
      static_cast<void>(correction_.update(odometry));
    }
  };
  for (int scan = 0; scan < 60; ++scan) {
    rest(0.1);
    correction_.propose_alignment({0.0, 0.01});
  }
  rest(kDt);
  const StateEstimate& published = correction_.estimate();
  EXPECT_NEAR(published.v_WB_B.x(), 0.1, 0.01);
  EXPECT_NEAR(published.v_WB_B.y(), 0.0, 1e-3);
  EXPECT_NEAR((published.X_WB.p - odometry.X_WB.p).y(), 0.6, 1e-9);
  rest(10.0);
  EXPECT_LT(published.v_WB_B.norm(), 1e-3) << "without scans the velocity decays";
  EXPECT_NEAR((published.X_WB.p - odometry.X_WB.p).y(), 0.6, 1e-9);
  correction_.propose_alignment({50.0, 0.0});
  rest(kDt);
  EXPECT_LE(published.v_WB_B.norm(), 0.3 + 1e-9) << "a jump is no velocity";
}

// A fix of the position at the time of a scan, exact in all directions.
MapFix exact_fix(Utime taken, const Vector2d& position_W) {
  MapFix fix;
  fix.scan_utime = taken;
  fix.position_W = position_W;
  fix.information.diagonal() << 1e5, 1e5, 1e5;
  return fix;
}

// The vehicle swims north at 0.4 m/s through water that moves with `current`; the odometry knows of
// its swimming alone, and is `off` from the beginning.
struct FixedDive {
  explicit FixedDive(const Vector2d& off, const Vector2d& current = Vector2d::Zero())
      : off_W(off), current_W(current) {}

  [[nodiscard]] Vector2d swum(Utime t) const { return {0.0, 0.4 * to_seconds(t)}; }
  [[nodiscard]] Vector2d true_position(Utime t) const {
    return swum(t) + current_W * to_seconds(t);
  }

  void tick() {
    now += kTick;
    StateEstimate odometry;
    odometry.utime = now;
    odometry.valid = true;
    odometry.X_WB.p << swum(now) + off_W, -3.0;
    odometry.v_WB_B = Vector3d(0.0, 0.4, 0.0);
    odometry.covariance = 0.01 * Matrix6d::Identity();
    const Vector3d before = correction.estimate().X_WB.p;
    const StateEstimate& estimate = correction.update(odometry);
    if (now > kTick) {
      largest_step_m = std::max(largest_step_m, (estimate.X_WB.p - before).norm() - 0.4 * kDt);
    }
    jumps += correction.has_jumped() ? 1 : 0;
  }
  void run(double seconds) {
    for (const Utime end = now + from_seconds(seconds); now < end;) tick();
  }
  [[nodiscard]] bool fix(Utime taken) {
    return correction.propose(exact_fix(taken, true_position(taken)));
  }
  [[nodiscard]] double error_m() const {
    return (correction.estimate().X_WB.p.head<2>() - true_position(now)).norm();
  }

  static FrameCorrectionOptions options() {
    FrameCorrectionOptions options;
    options.fixes.emplace();
    return options;
  }
  Vector2d off_W;
  Vector2d current_W;
  FrameCorrection correction{options(), {}};
  Utime now = 0;
  double largest_step_m = 0.0;
  int jumps = 0;
};

TEST(FrameCorrectionWithFixes, ASmallCorrectionIsAppliedSmoothlyAndIsUncertainMeanwhile) {
  FixedDive dive({0.2, -0.1});
  dive.run(2.0);
  ASSERT_TRUE(dive.fix(dive.now - 100'000));
  dive.tick();
  EXPECT_GT(dive.error_m(), 0.2) << "not at once";
  EXPECT_GT(horizontal_sigma(dive.correction.estimate()), 0.2);
  dive.run(2.0);
  EXPECT_LT(dive.error_m(), 0.06);
  EXPECT_LT(horizontal_sigma(dive.correction.estimate()), 0.16)
      << "0.8 m with a speed that is known to 14 %";
  EXPECT_LE(dive.largest_step_m, 0.0035) << "0.15 m/s";
  EXPECT_EQ(dive.jumps, 0);
}

// The vehicle is slower than the odometry: most of that passes for an error of its full speed.
TEST(FrameCorrectionWithFixes, PublishesTheVelocityWithWhichItsPositionMoves) {
  FixedDive dive(Vector2d::Zero(), {0.0, -0.06});
  for (int i = 0; i < 60; ++i) {
    dive.run(0.5);
    ASSERT_TRUE(dive.fix(dive.now - 100'000));
  }
  dive.run(2.0);
  EXPECT_LT(dive.correction.unmodelled().speed_scale, -0.05);
  const Vector3d before = dive.correction.estimate().X_WB.p;
  dive.run(1.0);
  const StateEstimate& estimate = dive.correction.estimate();
  const Vector3d velocity = estimate.X_WB.q * estimate.v_WB_B;
  EXPECT_LT((estimate.X_WB.p - before - velocity).norm(), 2e-3);
  EXPECT_NEAR(velocity.y(), 0.34, 0.01);
}

TEST(FrameCorrectionWithFixes, ALargeCorrectionIsAppliedAtOnceAndReported) {
  FixedDive dive({0.4, 0.3});
  dive.run(2.0);
  ASSERT_TRUE(dive.fix(dive.now - 100'000));
  dive.tick();
  EXPECT_LT(dive.error_m(), 0.03);
  EXPECT_EQ(dive.jumps, 1);
  dive.run(1.0);
  EXPECT_EQ(dive.jumps, 1);
}

TEST(FrameCorrectionWithFixes, AFixWithAProblemOrOfAnotherTimeIsNotUsed) {
  FixedDive dive({0.2, 0.0});
  dive.run(10.0);
  MapFix ambiguous = exact_fix(dive.now, dive.true_position(dive.now));
  ambiguous.problem = MapFixProblem::kAmbiguous;
  EXPECT_FALSE(dive.correction.propose(ambiguous));
  EXPECT_FALSE(dive.fix(dive.now - 8'000'000)) << "older than the stored poses";
  EXPECT_FALSE(dive.fix(dive.now + 1'000'000)) << "of the future";
  dive.run(2.0);
  EXPECT_GT(dive.error_m(), 0.19);
}

TEST(FrameCorrectionWithFixes, AmbiguousScansShowHowTheVehicleMovesButNotWhereItIs) {
  FixedDive dive(Vector2d::Zero(), {0.05, 0.0});
  for (int i = 0; i < 40; ++i) {
    dive.run(0.5);
    const Utime taken = dive.now - 100'000;
    MapFix fix = exact_fix(taken, dive.true_position(taken) + Vector2d(0.4, 0.0));
    fix.problem = MapFixProblem::kAmbiguous;
    EXPECT_FALSE(dive.correction.propose(fix));
  }
  EXPECT_LT(dive.error_m(), 0.2) << "1 m of current";
  EXPECT_NEAR(dive.correction.estimate().v_WB_B.x(), 0.05, 0.01);
  EXPECT_GT(horizontal_sigma(dive.correction.estimate()), 0.1) << "the place is not known";
}

TEST(FrameCorrectionWithFixes, APlaceThatChangesBetweenTwoAmbiguousScansIsNoMotion) {
  FixedDive dive(Vector2d::Zero());
  for (int i = 0; i < 20; ++i) {
    dive.run(0.5);
    MapFix fix = exact_fix(dive.now, dive.true_position(dive.now) + Vector2d(0.4 * (i % 2), 0.0));
    fix.problem = MapFixProblem::kAmbiguous;
    EXPECT_FALSE(dive.correction.propose(fix));
  }
  EXPECT_LT(dive.error_m(), 0.02);
}

TEST(FrameCorrectionWithFixes, CamerasGiveTheVelocityAndNotThePosition) {
  FixedDive dive(Vector2d::Zero(), {0.05, 0.0});
  const double turn = 0.7;  // of vision's frame, which begins anywhere
  for (int i = 0; i < 400; ++i) {
    dive.run(0.05);
    VisionEstimate seen;
    seen.frame_utime = seen.estimate.utime = dive.now - 60'000;
    seen.period_s = 0.05;
    seen.fault = VisionFault::kNone;
    seen.estimate.valid = true;
    seen.estimate.source = EstimatorKind::kVisualInertial;
    seen.estimate.X_WB = Pose{{7.0, -9.0, -3.0}, from_rpy(0.0, 0.0, turn)};
    seen.estimate.v_WB_B = {0.05, 0.4, 0.0};
    seen.estimate.covariance = 1e-4 * Matrix6d::Identity();
    dive.correction.propose(dive.now, seen);
  }
  EXPECT_EQ(dive.correction.estimate().source, EstimatorKind::kVisualInertial);
  EXPECT_LT(dive.error_m(), 0.2) << "1 m of current; vision is 11 m away";
  EXPECT_NEAR(dive.correction.estimate().v_WB_B.x(), 0.05, 0.01);
  dive.run(2.0);
  EXPECT_EQ(dive.correction.estimate().source, EstimatorKind::kPrimitive) << "no images";
  EXPECT_NEAR(dive.correction.estimate().v_WB_B.x(), 0.05, 0.02) << "a current stays";
}

TEST_F(FrameCorrectionTest, AllocatesNothing) {
  run(1.0);
  testing::reset_allocations();
  run(2.0);
  vision_works_ = false;
  run(1.0);
  correction_.propose_alignment({0.1, 0.0});
  EXPECT_EQ(testing::allocations().count, 0U);
}

TEST(FrameCorrection, DemandsIncreasingTimeAndValidOptions) {
  FrameCorrection correction({}, {});
  StateEstimate estimate;
  estimate.valid = true;
  estimate.utime = 20'000;
  static_cast<void>(correction.update(estimate));
  estimate.utime = 0;
  EXPECT_THROW(static_cast<void>(correction.update(estimate)), AssertionFailure);
  FrameCorrectionOptions options;
  options.approach = 0.0;
  EXPECT_NE(options.validate().find("approach"), std::string::npos);
  EXPECT_THROW(FrameCorrection(options, {}), AssertionFailure);
}

// For any vision updates at any times in any order: no step is longer than the two estimators'
// speeds and the approach explain, and the covariance stays valid.
RC_GTEST_PROP(FrameCorrection, PublishesNoJumpAndTheCorrectionThatExplainsIt,
              (std::uint32_t seed)) {
  Random random(seed, 3);
  FrameCorrectionOptions options;
  FrameCorrection correction(options, PrimitiveOptions{});
  Vector3d p_W(0, 0, -2);
  double yaw = random.uniform(-3.0, 3.0);
  double speed = 0.0;
  double rate = 0.0;
  Vector3d before = p_W;
  for (int i = 1; i < 1500; ++i) {
    if (i % 50 == 0) {
      speed = random.uniform(-0.2, 0.8);
      rate = random.uniform(-0.6, 0.6);
    }
    StateEstimate primitive;
    primitive.utime = kTick * i;
    primitive.valid = true;
    yaw += kDt * rate;
    primitive.X_WB.q = from_rpy(random.uniform(-0.1, 0.1), 0.05, yaw);
    primitive.v_WB_B = Vector3d(speed, 0.05, 0.0);
    const Vector3d v_W = primitive.X_WB.q * primitive.v_WB_B;
    p_W.head<2>() += kDt * v_W.head<2>();
    primitive.X_WB.p = p_W;
    primitive.covariance = 0.01 * Matrix6d::Identity();
    if (i > 20 && random.uniform() < 0.5) {
      VisionEstimate update;
      update.frame_utime = kTick * i - static_cast<Utime>(random.uniform(0.0, 150'000.0));
      update.init_utime = random.uniform() < 0.01 ? update.frame_utime : Utime{0};
      update.fault = random.uniform() < 0.2 ? VisionFault::kLost : VisionFault::kNone;
      update.estimate = primitive;
      update.estimate.utime = update.frame_utime;
      update.estimate.X_WB.p += Vector3d(random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0), 0.0);
      update.estimate.X_WB.q = from_rpy(0.0, 0.0, random.uniform(-0.5, 0.5)) * primitive.X_WB.q;
      update.estimate.v_WB_B += Vector3d(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0.0);
      correction.propose(kTick * i, update);
    }
    const StateEstimate& published = correction.update(primitive);
    const Vector3d step = published.X_WB.p - before;
    before = published.X_WB.p;
    if (i == 1) continue;
    const double turning = 0.3 * deg_to_rad(options.approach_deg);
    const double most = 0.85 + options.gate.max_excess_speed + options.approach + turning;
    RC_ASSERT(step.head<2>().norm() <= most * kDt);
    const Pose expected = published.map_from_odom * primitive.X_WB;
    RC_ASSERT((expected.p - published.X_WB.p).norm() < 1e-9);
    RC_ASSERT(angle_between(expected.q, published.X_WB.q) < 1e-6);
    const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(published.covariance);
    RC_ASSERT(solver.eigenvalues().minCoeff() > 0.0);
    RC_ASSERT(published.covariance.isApprox(published.covariance.transpose(), 1e-12));
  }
}

}  // namespace
}  // namespace dive::estimation
