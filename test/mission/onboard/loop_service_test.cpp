// Loop closure as a service: a vehicle that goes sideways along a painted wall and back, and an
// estimator that drifts as drawn here.

#include "mission/onboard/loop_service.h"

#include <chrono>
#include <future>
#include <limits>
#include <memory>
#include <thread>
#include <utility>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/random.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::mission {
namespace {

using estimation::Keyframe;
using estimation::LoopCorrection;
using estimation::StateEstimate;
using estimation::VisionEstimate;

constexpr Utime kTick = 20'000;
constexpr Utime kStep = 4'000'000;  // from one keyframe to the next
constexpr Utime kLatency = 400'000;
constexpr int kOut = 8;  // keyframes, and as many back
constexpr Utime kTurn = kOut * kStep;
constexpr double kStepLength = 0.3;
constexpr double kDrift = 0.02;  // m, one sigma of a step

CameraModel camera(double y) { return estimation::testing::pinhole_camera(y, 376, 240, 230.0); }

LoopSettings settings() {
  LoopSettings settings;
  settings.closer.keyframe_m = 0.9 * kStepLength;
  settings.latency = kLatency;
  return settings;
}

LoopService::Process finder() {
  const auto finder =
      std::make_shared<estimation::LoopFinder>(settings().closer, camera(0.07), camera(-0.07));
  return [finder](const Keyframe& keyframe) { return finder->process(keyframe); };
}

Pose true_pose(int step) {
  const int out = step <= kOut ? step : 2 * kOut - step;
  return {{0.0, -1.2 + kStepLength * out, -1.0}, Eigen::Quaterniond::Identity()};
}

/// An estimate of the service, its time and the true pose.
struct Answer {
  Utime utime = 0;
  VisionEstimate estimate;
  Pose truth;
};

class LoopServiceTest : public ::testing::Test {
 protected:
  void use(LoopService::Process process, OnLate late = OnLate::kBlock, bool moves_map = false) {
    LoopSettings loops = settings();
    loops.moves_map = moves_map;
    service_.emplace(std::move(process), loops, late);
    moved_ = {};
    now_ = 0;
    random_ = Random(3);
    room_ = estimation::testing::PaintedRoom({3, 4, 2});
    error_W_.setZero();
    variance_ = 1e-6;
    answers_.clear();
  }

  [[nodiscard]] StateEstimate filter(int step) const {
    StateEstimate estimate;
    estimate.utime = now_;
    estimate.valid = true;
    estimate.X_WB = true_pose(step);
    estimate.X_WB.p += error_W_;
    estimate.covariance.diagonal() << variance_, variance_, 1e-4, 1e-6, 1e-6, 1e-6;
    return estimate;
  }

  [[nodiscard]] Keyframe keyframe(int step) {
    Pose seen_from = true_pose(step);
    if (step > kOut) seen_from.p.y() += look_alike_m_;
    const auto image = [&](double y) {
      return room_.image(camera(y), seen_from * camera(y).X_BC, now_);
    };
    return {image(0.07),       image(-0.07),       filter(step),
            camera(0.07).X_BC, camera(-0.07).X_BC, init_utime_};
  }

  [[nodiscard]] VisionEstimate corrected(int step) const {
    VisionEstimate word;
    word.init_utime = init_utime_;
    word.estimate = filter(step);
    service_->correct(word);
    return word;
  }

  // To the next keyframe, with a word at every tick.
  void advance(int step) {
    if (step > 0) {
      error_W_.head<2>() += kDrift * Eigen::Vector2d(random_.normal(), random_.normal());
      variance_ += kDrift * kDrift;
    }
    service_->submit(keyframe(step), now_);
    for (const Utime end = now_ + kStep; now_ < end;) {
      now_ += kTick;
      service_->poll(now_);
      if (const auto moved = service_->take_map_correction()) {
        EXPECT_TRUE(is_well_formed(*moved));
        moved_ = moved->newest() * moved_;
        first_moved_m_ = moved->at(0).translation.norm();
      }
      answers_.push_back({now_, corrected(step), true_pose(step)});
    }
  }

  void go_and_return() {
    for (int step = 0; step <= 2 * kOut; ++step) advance(step);
  }

  std::optional<LoopService> service_;
  estimation::testing::PaintedRoom room_{{3, 4, 2}};
  Random random_{3};
  Utime now_ = 0;
  Utime init_utime_ = 7;
  double look_alike_m_ = 0.0;  ///< Shift of the wall observed on the return, m.
  Eigen::Vector3d error_W_ = Eigen::Vector3d::Zero();
  double variance_ = 0.0;
  std::vector<Answer> answers_;
  PlanarTransform moved_;       ///< Product of the map's corrections at the vehicle.
  double first_moved_m_ = 0.0;  ///< m by the last one at the time of the first keyframe.
};

TEST_F(LoopServiceTest, RemovesDriftWithAConsistentCovariance) {
  use(finder());
  go_and_return();
  const VisionEstimate& last = answers_.back().estimate;
  ASSERT_GT(last.loops.count, 2);
  EXPECT_GE(last.loops.recognised - last.loops.first_observed, 20'000'000);
  EXPECT_LT(last.loops.first_observed, kTurn);
  const Eigen::Vector3d error = answers_.back().truth.p - last.estimate.X_WB.p;
  EXPECT_GT(error_W_.norm(), 0.06);
  EXPECT_LT(error.norm(), 0.5 * error_W_.norm());
  const Eigen::Matrix2d P = last.estimate.covariance.topLeftCorner<2, 2>();
  EXPECT_LT(P.trace(), 2.0 * variance_);
  EXPECT_LT(error.head<2>().dot(P.inverse() * error.head<2>()), 12.0);
  EXPECT_GE(last.estimate.covariance(2, 2), 1e-4) << "loops do not observe the height";
  EXPECT_NEAR(last.estimate.X_WB.p.z(), -1.0, 0.02);
}

// The estimates stay in the filter's frame; the frame correction moves it.
TEST_F(LoopServiceTest, InAnUnknownEnvironmentItMovesTheMapInstead) {
  use(finder(), OnLate::kBlock, true);
  go_and_return();
  const VisionEstimate& last = answers_.back().estimate;
  ASSERT_GT(last.loops.count, 2);
  EXPECT_EQ(last.estimate.X_WB.p, filter(2 * kOut).X_WB.p);
  const Eigen::Vector3d error = answers_.back().truth.p - moved_ * last.estimate.X_WB.p;
  EXPECT_LT(error.norm(), 0.5 * error_W_.norm());
  EXPECT_LT(first_moved_m_, 0.01) << "where it began the map stays";
  const Eigen::Matrix2d P = last.estimate.covariance.topLeftCorner<2, 2>();
  EXPECT_LT(P.trace(), 2.0 * variance_);
  EXPECT_LT(error.head<2>().dot(P.inverse() * error.head<2>()), 12.0);
}

// A vehicle that the observed map has put where it is must not be put there twice.
TEST_F(LoopServiceTest, WhatAnAlignmentHasCorrectedALoopDoesNotCorrectAgain) {
  use(finder(), OnLate::kBlock, true);
  for (int step = 0; step <= kOut + 2; ++step) advance(step);
  const Eigen::Vector2d aligned = -error_W_.head<2>();
  service_->align(aligned);
  const int before = answers_.back().estimate.loops.count;
  for (int step = kOut + 3; step <= 2 * kOut; ++step) advance(step);
  const VisionEstimate& last = answers_.back().estimate;
  ASSERT_GT(last.loops.count, before);
  const Eigen::Vector3d published =
      moved_ * Eigen::Vector3d(last.estimate.X_WB.p + Eigen::Vector3d(aligned.x(), aligned.y(), 0));
  EXPECT_GT(aligned.norm(), 0.05);
  EXPECT_LT((answers_.back().truth.p - published).norm(), 0.5 * aligned.norm());
}

TEST_F(LoopServiceTest, AnswersAtTheStatedTimeAndAlwaysTheSame) {
  use(finder());
  go_and_return();
  const std::vector<Answer> first = std::exchange(answers_, {});
  use(finder());
  go_and_return();
  ASSERT_EQ(first.size(), answers_.size());
  int count = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const VisionEstimate& word = first[i].estimate;
    EXPECT_EQ(word.estimate.X_WB.p, answers_[i].estimate.estimate.X_WB.p);
    EXPECT_EQ(word.estimate.covariance, answers_[i].estimate.estimate.covariance);
    EXPECT_EQ(word.loops.moved_m, answers_[i].estimate.loops.moved_m);
    if (word.loops.count == count) continue;
    EXPECT_EQ(word.loops.count, ++count);
    EXPECT_EQ(first[i].utime, word.loops.recognised + kLatency);
  }
  EXPECT_GT(count, 2);
}

// A copy of the wall, shifted by less than the width of an image. Places that were observed twice
// on one wall are still recognised.
TEST_F(LoopServiceTest, APlaceThatOnlyResemblesAnotherChangesNothing) {
  for (const double off : {-0.8, 0.8}) {
    look_alike_m_ = off;
    use(finder());
    go_and_return();
    for (const Answer& answer : answers_) {
      const estimation::ClosedLoops& loops = answer.estimate.loops;
      EXPECT_FALSE(loops.first_observed <= kTurn && loops.recognised > kTurn);
      EXPECT_LT(loops.moved_m, 0.25);
    }
  }
}

TEST_F(LoopServiceTest, ARestartedFilterIsNotCorrectedByEarlierPlaces) {
  use(finder());
  go_and_return();
  const int count = answers_.back().estimate.loops.count;
  init_utime_ = 8;
  EXPECT_EQ(corrected(2 * kOut).estimate.X_WB.p, filter(2 * kOut).X_WB.p);
  for (const int step : {0, 1, 2}) advance(step);
  EXPECT_EQ(answers_.back().estimate.loops.count, count);
  EXPECT_EQ(answers_.back().estimate.estimate.X_WB.p, filter(2).X_WB.p);
}

TEST_F(LoopServiceTest, WhatIsNotFiniteIsNotTouched) {
  use(finder());
  go_and_return();
  VisionEstimate word;
  word.init_utime = init_utime_;
  word.estimate = filter(2 * kOut);
  word.estimate.covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();
  const Pose before = word.estimate.X_WB;
  service_->correct(word);
  EXPECT_EQ(word.estimate.X_WB.p, before.p);
}

// Would never come back from a poll that waits.
TEST_F(LoopServiceTest, AWorkerThatIsLateDelaysAndNeverBlocks) {
  std::promise<void> done;
  const std::shared_future<void> is_done = done.get_future().share();
  int processed = 0;
  use(
      [&](const Keyframe& keyframe) {
        ++processed;
        is_done.wait();
        LoopCorrection correction;
        correction.utime = keyframe.filter.utime;
        correction.filter = keyframe.filter.X_WB;
        correction.correction.p.x() = 0.5;
        return std::optional(correction);
      },
      OnLate::kPoll);
  for (const int step : {0, 1, 2}) advance(step);
  EXPECT_EQ(answers_.back().estimate.loops.count, 0);
  done.set_value();
  // The machine may take its time to notice.
  for (int i = 0; i < 60'000 && corrected(2).loops.count == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    service_->poll(now_);
  }
  EXPECT_EQ(processed, 1) << "one at a time is processed";
  EXPECT_EQ(corrected(2).loops.count, 1);
  EXPECT_NEAR(corrected(2).loops.moved_m, 0.5, 1e-12);
  EXPECT_NEAR(corrected(2).estimate.X_WB.p.x() - filter(2).X_WB.p.x(), 0.5, 1e-12);
}

}  // namespace
}  // namespace dive::mission
