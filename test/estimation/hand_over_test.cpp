// The hand-over fed by hand: a primitive estimator that is wrong in a known way, and words of
// vision that are written here.

#include "estimation/hand_over.h"

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

// A vehicle that swims east at 0.4 m/s in water that moves north, and a compass that is off.
class HandOverTest : public ::testing::Test {
 protected:
  [[nodiscard]] Vector3d true_position(Utime t) const {
    return Vector3d(0.4, current_, 0.0) * to_seconds(t) - 3.0 * Vector3d::UnitZ();
  }

  [[nodiscard]] StateEstimate reckoned() const {
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

  [[nodiscard]] VisionEstimate word(Utime taken) const {
    VisionEstimate word;
    word.frame_utime = taken;
    word.begun_from = begun_from_;
    word.fault = VisionFault::kNone;
    word.period_s = to_seconds(kPeriod);
    word.estimate.utime = taken;
    word.estimate.valid = true;
    word.estimate.source = EstimatorKind::kVisualInertial;
    word.estimate.X_WB.p = true_position(taken) + vision_off_;
    word.estimate.v_WB_B = Vector3d(0.4, current_, 0.0);
    word.estimate.covariance = 1e-4 * Matrix6d::Identity();
    return word;
  }

  // One tick, with the word that is due, if vision speaks.
  const StateEstimate& tick() {
    now_ += kTick;
    if (speaks_ && now_ >= next_due_) {
      VisionEstimate due = word(next_due_ - kLatency);
      due.fault = says_;
      hand_over_.add(now_, due);
      if (says_once_) says_ = VisionFault::kNone;
    }
    while (now_ >= next_due_) next_due_ += kPeriod;
    const Vector3d before = hand_over_.estimate().X_WB.p;
    const StateEstimate& estimate = hand_over_.update(reckoned());
    if (now_ > kTick) step_ = (estimate.X_WB.p - before).norm();
    largest_step_ = std::max(largest_step_, step_);
    return estimate;
  }

  const StateEstimate& run(double seconds) {
    for (const Utime end = now_ + from_seconds(seconds); now_ < end;) tick();
    return hand_over_.estimate();
  }

  // Ticks until the source is `source`, at most 5 s; s.
  double until(EstimatorKind source) {
    const Utime begin = now_;
    while (hand_over_.estimate().source != source && now_ - begin < 5'000'000) tick();
    return to_seconds(now_ - begin);
  }

  [[nodiscard]] double error() const {
    return (hand_over_.estimate().X_WB.p - true_position(now_)).norm();
  }

  HandOver hand_over_{HandOverOptions{}, PrimitiveOptions{}};
  Utime now_ = 0;
  Utime next_due_ = 100'000;
  double current_ = 0.0;
  double compass_off_ = 0.0;
  Vector3d vision_off_ = Vector3d::Zero();
  Utime begun_from_ = 0;
  bool speaks_ = true;
  VisionFault says_ = VisionFault::kNone;
  bool says_once_ = false;
  double step_ = 0.0;
  double largest_step_ = 0.0;
};

constexpr auto kBySight = EstimatorKind::kVisualInertial;
constexpr auto kReckoned = EstimatorKind::kPrimitive;

TEST_F(HandOverTest, ThePrimitiveEstimateIsPublishedAsItIsUntilVisionWasBelieved) {
  speaks_ = false;
  const StateEstimate& published = run(2.0);
  EXPECT_EQ(published.source, kReckoned);
  EXPECT_EQ(published.X_WB.p, reckoned().X_WB.p);
  EXPECT_EQ(published.covariance, reckoned().covariance);
  EXPECT_EQ(hand_over_.fault(), VisionFault::kStarting);
}

TEST_F(HandOverTest, VisionIsFollowedInWaterThatMovesAndWithACompassThatIsOff) {
  current_ = 0.2;
  compass_off_ = deg_to_rad(3.0);
  EXPECT_LT(until(kBySight), 0.5);
  run(10.0);
  EXPECT_LT(error(), 0.002);
  const StateEstimate& published = hand_over_.estimate();
  EXPECT_LT(std::abs(to_rpy(published.X_WB.q).z()), deg_to_rad(0.1));
  EXPECT_NEAR(published.v_WB_B.y(), 0.2, 0.01);
  EXPECT_EQ(hand_over_.fault(), VisionFault::kNone);
}

TEST_F(HandOverTest, BadWordsAreOverWithinThreePicturesAndSilenceTakesNoLonger) {
  run(10.0);
  says_ = VisionFault::kDark;
  const Utime dark = now_;
  until(kReckoned);
  EXPECT_LE(to_seconds(now_ - dark), 2.6 * to_seconds(kPeriod));
  EXPECT_EQ(hand_over_.fault(), VisionFault::kDark);
  says_ = VisionFault::kNone;
  EXPECT_LT(until(kBySight), 0.25);
  run(10.0);
  speaks_ = false;
  const Utime silent = now_;
  until(kReckoned);
  EXPECT_LE(to_seconds(now_ - silent), 3.0 * to_seconds(kPeriod));
  EXPECT_EQ(hand_over_.fault(), VisionFault::kNoPictures);
}

TEST_F(HandOverTest, OneBadWordIsNone) {
  run(3.0);
  says_once_ = true;
  for (int i = 0; i < 20; ++i) {
    says_ = VisionFault::kLost;
    run(0.17);
    ASSERT_EQ(hand_over_.estimate().source, kBySight) << i;
  }
}

// What the water does goes on, and is known.
TEST_F(HandOverTest, InTheDarkTheWaterGoesOnAsItDid) {
  current_ = 0.2;
  run(4.0);
  speaks_ = false;
  run(7.0);
  EXPECT_EQ(hand_over_.estimate().source, kReckoned);
  EXPECT_LT(error(), 0.15) << "of 1.4 m that it was carried";
  EXPECT_GT(horizontal_sigma(hand_over_.estimate()), 0.5 * error());
}

TEST_F(HandOverTest, TheCovarianceGrowsInTheDarkAndHoldsWhatIsLeftOfTheWayBack) {
  run(5.0);
  const double before = horizontal_sigma(hand_over_.estimate());
  speaks_ = false;
  double last = before;
  for (int i = 0; i < 10; ++i) {
    const double sigma = horizontal_sigma(run(1.0));
    EXPECT_GT(sigma, last);
    last = sigma;
  }
  vision_off_.y() = 0.5;
  speaks_ = true;
  until(kBySight);
  EXPECT_GT(hand_over_.offset_m(), 0.4);
  EXPECT_GT(horizontal_sigma(hand_over_.estimate()), 0.4);
  run(5.0);
  EXPECT_LT(hand_over_.offset_m(), 0.01);
  EXPECT_LT(horizontal_sigma(hand_over_.estimate()), 2.0 * before);
}

// Vision that comes and goes is believed less and less quickly, for each time costs a plan.
TEST_F(HandOverTest, WhoIsLostSoonMustBeGoodForLonger) {
  double last = 0.0;
  for (int i = 0; i < 4; ++i) {
    says_ = VisionFault::kNone;
    const double waited = until(kBySight);
    EXPECT_GE(waited, last - kDt);
    EXPECT_LT(waited, 1.0);
    last = waited;
    says_ = VisionFault::kFewFeatures;
    until(kReckoned);
  }
  EXPECT_GT(last, 0.5);
  says_ = VisionFault::kNone;
  until(kBySight);
  run(10.0);
  says_ = VisionFault::kDark;
  until(kReckoned);
  says_ = VisionFault::kNone;
  EXPECT_LT(until(kBySight), 0.25) << "long ago is forgotten";
}

TEST_F(HandOverTest, WhatIsNoWordIsABadOne) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto after = [&](const std::function<void(VisionEstimate&)>& spoil) {
    HandOver hand_over(HandOverOptions{}, PrimitiveOptions{});
    now_ = 0;
    Utime next = 100'000;
    for (; now_ < 2'000'000;) {
      now_ += kTick;
      static_cast<void>(hand_over.update(reckoned()));
      if (now_ < next) continue;
      next += kPeriod;
      VisionEstimate said = word(now_ - kLatency);
      if (now_ > 1'000'000) spoil(said);
      hand_over.add(now_, said);
    }
    EXPECT_TRUE(hand_over.estimate().X_WB.is_finite());
    EXPECT_TRUE(hand_over.estimate().covariance.allFinite());
    return hand_over.estimate().source == kBySight ? VisionFault::kNone : hand_over.fault();
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
  EXPECT_EQ(after([](VisionEstimate& w) { w.frame_utime = 1'000'000; }), VisionFault::kBadPicture);
  EXPECT_EQ(after([](VisionEstimate& w) { w.frame_utime += 1'000'000; }), VisionFault::kBadPicture);
  EXPECT_EQ(after([](VisionEstimate& w) { w.frame_utime = 1'900'000 - w.frame_utime; }),
            VisionFault::kBadPicture);
  EXPECT_EQ(after([](VisionEstimate& w) { w.estimate.valid = false; }), VisionFault::kStarting);
}

TEST_F(HandOverTest, AWordOfLongAgoIsLate) {
  run(3.0);
  speaks_ = false;
  const VisionEstimate old = word(now_ - 20'000);
  run(1.0);
  hand_over_.add(now_, old);
  EXPECT_EQ(hand_over_.fault(), VisionFault::kLate);
}

// Where the map says that the vehicle is elsewhere, vision does not pull it back; a filter that
// begins anew from what is published knows of it already.
TEST_F(HandOverTest, AMapMovesVisionWithIt) {
  run(3.0);
  hand_over_.moved({0.0, 0.3});
  run(3.0);
  EXPECT_NEAR(hand_over_.estimate().X_WB.p.y(), 0.3, 1e-3);
  EXPECT_EQ(hand_over_.estimate().source, kBySight);
  begun_from_ = now_;
  vision_off_.y() = 0.3;
  run(1.0);
  EXPECT_NEAR(hand_over_.estimate().X_WB.p.y(), 0.3, 1e-3);
  EXPECT_LT(hand_over_.offset_m(), 0.01);
  speaks_ = false;
  const double before = run(1.0).X_WB.p.y();
  hand_over_.moved({0.0, -0.2});
  EXPECT_NEAR(run(0.02).X_WB.p.y(), before - 0.2, 0.01) << "in the dark as well";
}

TEST_F(HandOverTest, AllocatesNothing) {
  run(1.0);
  testing::reset_allocations();
  run(2.0);
  speaks_ = false;
  run(1.0);
  hand_over_.moved({0.1, 0.0});
  EXPECT_EQ(testing::allocations().count, 0U);
}

TEST(HandOver, DemandsTimeThatRunsAndOptionsThatHold) {
  HandOver hand_over({}, {});
  StateEstimate estimate;
  estimate.valid = true;
  estimate.utime = 20'000;
  static_cast<void>(hand_over.update(estimate));
  estimate.utime = 0;
  EXPECT_THROW(static_cast<void>(hand_over.update(estimate)), AssertionFailure);
  HandOverOptions options;
  options.approach = 0.0;
  EXPECT_NE(options.validate().find("approach"), std::string::npos);
  EXPECT_THROW(HandOver(options, {}), AssertionFailure);
}

// Whatever vision says, of whatever moment, in whatever order: no step is longer than what the two
// estimators' speeds and the approach explain, and the covariance stays one.
RC_GTEST_PROP(HandOver, PublishesNoJump, (std::uint32_t seed)) {
  Random random(seed, 3);
  HandOverOptions options;
  HandOver hand_over(options, PrimitiveOptions{});
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
      VisionEstimate word;
      word.frame_utime = kTick * i - static_cast<Utime>(random.uniform(0.0, 150'000.0));
      word.begun_from = random.uniform() < 0.01 ? word.frame_utime : Utime{0};
      word.fault = random.uniform() < 0.2 ? VisionFault::kLost : VisionFault::kNone;
      word.estimate = primitive;
      word.estimate.utime = word.frame_utime;
      word.estimate.X_WB.p += Vector3d(random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0), 0.0);
      word.estimate.X_WB.q = from_rpy(0.0, 0.0, random.uniform(-0.5, 0.5)) * primitive.X_WB.q;
      word.estimate.v_WB_B += Vector3d(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0.0);
      hand_over.add(kTick * i, word);
    }
    const StateEstimate& published = hand_over.update(primitive);
    const Vector3d step = published.X_WB.p - before;
    before = published.X_WB.p;
    if (i == 1) continue;
    const double turning = 0.3 * deg_to_rad(options.approach_deg);
    const double most = 0.85 + options.max_excess + options.approach + turning;
    RC_ASSERT(step.head<2>().norm() <= most * kDt);
    const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(published.covariance);
    RC_ASSERT(solver.eigenvalues().minCoeff() > 0.0);
    RC_ASSERT(published.covariance.isApprox(published.covariance.transpose(), 1e-12));
  }
}

}  // namespace
}  // namespace dive::estimation
