// The visual-inertial estimator as a service, in a painted room, on images and samples whose truth
// is known.

#include "mission/onboard/vision_service.h"

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimation/dataset/recording_feed.h"
#include "mission/onboard/stereo_mapping.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::mission {
namespace {

using estimation::VisionEstimate;
using estimation::VisionFault;

constexpr Utime kTick = 20'000;
constexpr Utime kPeriod = 100'000;
constexpr Utime kLatency = 80'000;
constexpr double kSpeed = 0.3;

CameraModel small_camera(double y) {
  return estimation::testing::pinhole_camera(y, 320, 208, 190.0);
}

estimation::VisionOptions options() {
  estimation::VisionOptions options;
  options.period_s = to_seconds(kPeriod);
  options.filter.cameras = {small_camera(0.07), small_camera(-0.07)};
  return options;
}

// Swims along y past the wall ahead, and keeps its heading.
Pose pose_at(Utime t) {
  return {{0.0, kSpeed * to_seconds(t) - 3.0, -1.0}, Eigen::Quaterniond::Identity()};
}

/// What a test lays hands on.
struct Taken {
  std::optional<ImageFrame> left;
  std::optional<ImageFrame> right;
};

class VisionServiceTest : public ::testing::Test {
 protected:
  void use(OnLate late, RangeMaker make_range = nullptr,
           const std::optional<LoopSettings>& loops = std::nullopt,
           const std::optional<estimation::ImuBias>& bias = std::nullopt) {
    service_.emplace(options(), 1, kLatency, late, std::move(make_range), loops, bias);
  }

  [[nodiscard]] estimation::StateEstimate published() const {
    estimation::StateEstimate estimate;
    estimate.utime = now_;
    estimate.valid = true;
    estimate.X_WB = swims_at(now_);
    estimate.v_WB_B = {0.0, kSpeed, 0.0};
    estimate.covariance = 1e-4 * Matrix6d::Identity();
    return estimate;
  }

  void add() {
    for (int i = 1; i <= 4; ++i) {
      ImuSample sample;
      sample.utime = now_ - kTick + i * 5'000;
      sample.gyro_B = gyro_bias_B_;
      sample.accel_B = accel_bias_B_ + Eigen::Vector3d(0.0, acceleration_at(sample.utime), 9.81);
      if (imu_is_nan_) sample.gyro_B.x() = std::numeric_limits<double>::quiet_NaN();
      if (imu_speaks_) service_->add({&sample, 1});
    }
    service_->add(DepthSample{now_, 1.0});
  }

  [[nodiscard]] Taken take() {
    const auto image = [&](double y, int index) {
      const CameraModel camera = small_camera(y);
      ImageFrame frame = room_.image(camera, camera_pose_at(now_) * camera.X_BC, now_);
      frame.camera = index;
      return frame;
    };
    return {image(0.07, 0), image(-0.07, 1)};
  }

  // The words of so many seconds; `spoil` is given each pair.
  std::vector<VisionEstimate> run(double seconds,
                                  const std::function<void(Taken&)>& spoil = nullptr) {
    std::vector<VisionEstimate> words;
    for (const Utime end = now_ + from_seconds(seconds); now_ < end;) {
      now_ += kTick;
      add();
      if (auto word = service_->poll(now_)) {
        arrived_.push_back(now_ - word->frame_utime);
        words.push_back(*word);
        if (service_->take_scan()) ++scans_;
      }
      service_->observe(published());
      if (now_ % kPeriod != 0) continue;
      Taken taken = take();
      if (spoil) spoil(taken);
      service_->submit(std::move(taken.left), std::move(taken.right), now_);
    }
    return words;
  }

  [[nodiscard]] static std::vector<VisionFault> faults(const std::vector<VisionEstimate>& words) {
    std::vector<VisionFault> result;
    for (const VisionEstimate& word : words) result.push_back(word.fault);
    return result;
  }

  std::function<Pose(Utime)> swims_at = pose_at;
  std::function<Pose(Utime)> camera_pose_at = pose_at;  ///< Pose at which the images are taken.
  std::function<double(Utime)> acceleration_at = [](Utime) { return 0.0; };  ///< Along y, m/s^2.
  estimation::testing::PaintedRoom room_{{3, 4, 2}};
  std::optional<VisionService> service_;
  Utime now_ = 0;
  bool imu_speaks_ = true;
  bool imu_is_nan_ = false;
  Eigen::Vector3d gyro_bias_B_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_B_ = Eigen::Vector3d::Zero();
  std::vector<Utime> arrived_;
  int scans_ = 0;
};

// The scene in the images turns, the IMU does not: good images, and an estimate to reject.
TEST_F(VisionServiceTest, RefusesWhatContradictsTheInertialUnit) {
  use(OnLate::kBlock);
  ASSERT_TRUE(run(3.0).back().is_good());
  camera_pose_at = [](Utime t) {
    const double turned = 0.35 * std::sin(1.2 * (to_seconds(t) - 3.0));
    return Pose{pose_at(t).p, from_rpy(0.0, 0.0, turned)};
  };
  run(1.0);
  const std::vector<VisionEstimate> words = run(4.0);
  EXPECT_THAT(faults(words), ::testing::Contains(VisionFault::kRefused));
  for (const VisionEstimate& word : words) {
    EXPECT_FALSE(word.is_good())
        << "not even when it was initialised again, and takes it for its biases";
  }
  camera_pose_at = pose_at;
  EXPECT_TRUE(run(20.0).back().is_good()) << "in the end it is accepted again";
}

// Biases of a MEMS unit after switching on. A restarted process has no time to find them again.
TEST_F(VisionServiceTest, BeginsWithTheBiasesThatWereFoundBeforeARestart) {
  gyro_bias_B_ = {0.05, -0.03, 0.04};
  accel_bias_B_ = {0.15, -0.1, 0.1};
  use(OnLate::kBlock);
  EXPECT_GT(run(1.0).front().estimate.omega_WB_B.norm(), 0.05) << "it knows nothing yet";
  EXPECT_FALSE(service_->imu_bias()) << "nothing is proved yet";
  run(13.0);
  const std::optional<estimation::ImuBias> found = service_->imu_bias();
  ASSERT_TRUE(found);
  EXPECT_LT((found->gyro_B - gyro_bias_B_).norm(), 0.005);
  EXPECT_LT((found->gyro_B - gyro_bias_B_).cwiseAbs().maxCoeff(), 4.0 * found->gyro_sigma);
  EXPECT_LT((found->accel_B - accel_bias_B_).cwiseAbs().maxCoeff(), 4.0 * found->accel_sigma);

  use(OnLate::kBlock, nullptr, std::nullopt, found);
  EXPECT_EQ(service_->imu_bias()->gyro_B, found->gyro_B) << "kept if it is restarted again";
  EXPECT_LT(run(1.0).front().estimate.omega_WB_B.norm(), 0.01);
}

TEST_F(VisionServiceTest, BeginsInMotionAndAnswersEachPairAtItsTime) {
  use(OnLate::kBlock);
  const std::vector<VisionEstimate> words = run(2.0);
  ASSERT_GE(words.size(), 18U);
  EXPECT_THAT(arrived_, ::testing::Each(kLatency));
  for (std::size_t i = 4; i < words.size(); ++i) {
    EXPECT_TRUE(words[i].is_good()) << i << ": " << to_sentence(words[i].fault);
    const estimation::StateEstimate& estimate = words[i].estimate;
    EXPECT_LT((estimate.X_WB.p - pose_at(estimate.utime).p).norm(), 0.02) << i;
    EXPECT_EQ(words[i].init_utime, words[4].init_utime);
  }
}

TEST_F(VisionServiceTest, IsTheSameOnEveryMachine) {
  use(OnLate::kBlock);
  const std::vector<VisionEstimate> first = run(1.0);
  now_ = 0;
  room_ = estimation::testing::PaintedRoom({3, 4, 2});
  use(OnLate::kBlock);
  const std::vector<VisionEstimate> second = run(1.0);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].estimate.X_WB.p, second[i].estimate.X_WB.p) << i;
    EXPECT_EQ(first[i].estimate.covariance, second[i].estimate.covariance) << i;
    EXPECT_EQ(first[i].used, second[i].used) << i;
  }
}

TEST_F(VisionServiceTest, ReportsWhatIsWrongWithTheImages) {
  use(OnLate::kBlock);
  run(1.0);
  const auto spoiled = [&](const std::function<void(Taken&)>& spoil) {
    run(0.1, spoil);
    std::vector<VisionEstimate> words = run(0.4, spoil);
    run(1.0);
    return faults(words);
  };
  using ::testing::Each;
  EXPECT_THAT(spoiled([](Taken& t) {
                for (auto& p : t.left->pixels) p = 3;
              }),
              Each(VisionFault::kDark));
  std::optional<ImageFrame> kept;
  EXPECT_THAT(spoiled([&](Taken& t) {
                if (kept) t.left->pixels = kept->pixels;
                kept = t.left;
              }),
              ::testing::Contains(VisionFault::kFrozen).Times(::testing::Ge(3)));
  EXPECT_THAT(spoiled([](Taken& t) { t.left->width = 160; }), Each(VisionFault::kBadImage));
  EXPECT_THAT(spoiled([](Taken& t) { t.left->utime = 900'000; }), Each(VisionFault::kBadImage));
  EXPECT_THAT(spoiled([](Taken& t) { t.left.reset(); }), Each(VisionFault::kNoImages));
  EXPECT_THAT(spoiled([](Taken& t) { t.right.reset(); }), Each(VisionFault::kNone))
      << "one camera is enough";
  EXPECT_TRUE(run(0.3).back().is_good());
}

TEST_F(VisionServiceTest, SurvivesAnInertialUnitThatIsSilentOrSendsNonsense) {
  use(OnLate::kBlock);
  run(1.0);
  const Utime begun = run(0.2).back().init_utime;
  imu_is_nan_ = true;
  for (const VisionEstimate& word : run(1.0)) {
    EXPECT_TRUE(word.estimate.X_WB.is_finite() && word.estimate.covariance.allFinite());
  }
  imu_is_nan_ = false;
  imu_speaks_ = false;
  for (const VisionEstimate& word : run(4.0)) EXPECT_TRUE(word.estimate.X_WB.is_finite());
  imu_speaks_ = true;
  run(1.5);
  const VisionEstimate last = run(0.2).back();
  EXPECT_TRUE(last.is_good()) << to_sentence(last.fault);
  EXPECT_GT(last.init_utime, begun);
  EXPECT_LT((last.estimate.X_WB.p - pose_at(last.estimate.utime).p).norm(), 0.1);
}

// What has thrown may be half updated.
TEST_F(VisionServiceTest, BeginsAgainAfterAnException) {
  bool must_throw = false;
  use(OnLate::kBlock, [&](const StereoPairResult&) -> std::optional<RangeScan> {
    if (std::exchange(must_throw, false)) throw std::runtime_error("no memory");
    return std::nullopt;
  });
  const Utime begun = run(1.0).back().init_utime;
  must_throw = true;
  EXPECT_THROW(run(0.5), std::runtime_error);
  run(1.0);
  const VisionEstimate last = run(0.2).back();
  EXPECT_TRUE(last.is_good()) << to_sentence(last.fault);
  EXPECT_GT(last.init_utime, begun);
}

TEST_F(VisionServiceTest, WhatIsMadeOfAPairComesWithItsAnswer) {
  std::size_t landmarks = 0;
  use(OnLate::kBlock, [&](const StereoPairResult& pair) -> std::optional<RangeScan> {
    if (pair.estimate) {
      EXPECT_EQ(pair.left->utime, pair.estimate->utime);
    }
    EXPECT_EQ(pair.right->camera, 1);
    landmarks += pair.landmarks.size();
    RangeScan scan;
    scan.utime = pair.left->utime;
    return scan;
  });
  const std::vector<VisionEstimate> words = run(2.0);
  EXPECT_EQ(scans_, static_cast<int>(words.size()));
  EXPECT_GT(landmarks, 0U);
}

// Points of the walls, relative to the pose at which the images were taken.
TEST_F(VisionServiceTest, TheStereoPairIsARangeSensor) {
  planning::MapperOptions mapper;
  mapper.min_neighbours = 3;
  const StereoMapping stereo =
      *stereo_mapping(small_camera(0.07), small_camera(-0.07), mapper, true);
  EXPECT_GT(stereo.mapper.noise.square, 0.002) << "1/m";
  EXPECT_EQ(stereo.mapper.validate(), "");
  EXPECT_EQ(stereo.mapper.min_neighbours, 3) << "the rest is the caller's";
  EXPECT_FALSE(stereo_mapping(small_camera(0.07), small_camera(0.07), mapper, true)) << "no pair";
  int points = 0;
  int wrong = 0;
  std::size_t landmarks = 0;
  int wrong_landmarks = 0;
  use(OnLate::kBlock, [&](const StereoPairResult& pair) {
    std::optional<RangeScan> scan = stereo.make_range(pair);
    EXPECT_EQ(scan.has_value(), pair.right != nullptr);
    if (!scan) return scan;
    EXPECT_EQ(scan->utime, pair.left->utime);
    landmarks += scan->landmarks;
    const Pose X_WB = pose_at(scan->utime);
    for (std::size_t i = 0; i < scan->points_B.size(); ++i) {
      const Eigen::Vector3f& p_B = scan->points_B[i];
      const Eigen::Vector3d p_W = X_WB * p_B.cast<double>();
      const double r = (p_B - scan->origin_B).norm();
      if (!p_W.allFinite() || r > scan->reach) continue;
      ++points;
      const double off = (p_W.cwiseAbs() - Eigen::Vector3d(3, 4, 2)).cwiseAbs().minCoeff();
      if (off > 0.01 + 3.0 * stereo.mapper.noise.square * r * r) {
        ++(i + scan->landmarks >= scan->points_B.size() ? wrong_landmarks : wrong);
      }
    }
    return scan;
  });
  run(2.0);
  EXPECT_GT(scans_, 15);
  EXPECT_GT(points, scans_ * 500) << "of 7,500 rays each";
  EXPECT_LT(wrong, points / 50);
  EXPECT_GT(landmarks, 50U);
  EXPECT_LT(wrong_landmarks, static_cast<int>(landmarks / 20));
  run(0.5, [](Taken& taken) { taken.right.reset(); });
}

// Back and forth along the wall: what was observed first is observed again.
TEST_F(VisionServiceTest, ClosesLoopsBesideTheEstimate) {
  constexpr double kReach = 1.2;
  constexpr double kRate = kSpeed / kReach;
  swims_at = camera_pose_at = [](Utime t) {
    return Pose{{0.0, kReach * std::sin(kRate * to_seconds(t)), -1.0},
                Eigen::Quaterniond::Identity()};
  };
  acceleration_at = [](Utime t) {
    return -kReach * kRate * kRate * std::sin(kRate * to_seconds(t));
  };
  LoopSettings loops;
  loops.closer.keyframe_m = 0.3;
  loops.closer.min_gap_s = 8.0;
  use(OnLate::kBlock, nullptr, loops);
  const std::vector<VisionEstimate> words = run(27.0);
  EXPECT_THAT(arrived_, ::testing::Each(kLatency)) << "nothing waits for a loop";
  EXPECT_GT(words.back().loops.count, 1);
  for (std::size_t i = 4; i < words.size(); ++i) {
    EXPECT_TRUE(words[i].is_good()) << i << ": " << to_sentence(words[i].fault);
    const estimation::StateEstimate& estimate = words[i].estimate;
    EXPECT_LT((estimate.X_WB.p - camera_pose_at(estimate.utime).p).norm(), 0.05) << i;
  }
}

TEST_F(VisionServiceTest, WhereNothingMayWaitWhatIsSaidIsSaidInOrder) {
  use(OnLate::kPoll);
  Utime last = 0;
  for (const VisionEstimate& word : run(1.0)) {
    EXPECT_GE(word.frame_utime, last);
    last = word.frame_utime;
  }
}

// A vehicle's inputs, given to the service of a dive tick by tick and to the pipeline of
// `dive estimate` as a recording.
class SameInputs : public VisionServiceTest {
 protected:
  static constexpr Utime kBegin = 10'000'000;  ///< The service's first tick.
  static constexpr Utime kFirstImage = kBegin + 100'000;
  static constexpr Utime kEnd = kFirstImage + 4'000'000;

  void SetUp() override {
    swims_at = [](Utime t) { return pose_at(t - kBegin); };
    recording_.cameras.resize(2);
    for (Utime t = kFirstImage; t <= kEnd; t += kPeriod) {
      const bool is_dark = t > kFirstImage + 2'000'000 && t < kFirstImage + 3'000'000;
      for (int c = 0; c < 2; ++c) {
        const CameraModel camera = small_camera(c == 0 ? 0.07 : -0.07);
        ImageFrame frame =
            room_.image(camera, swims_at(t) * camera.X_BC, t, 1.0, is_dark ? 0.0 : 1.0);
        frame.camera = c;
        recording_.cameras[static_cast<std::size_t>(c)].images.push_back(
            {t, "image", [frame] { return tl::expected<ImageFrame, std::string>(frame); }});
      }
      recording_.depth.push_back({t, 1.0});
    }
    for (Utime t = kBegin; t <= kEnd + 20'000; t += 5'000) {
      ImuSample sample;
      sample.utime = t;
      sample.accel_B = {0.0, 0.0, 9.81};
      recording_.imu.push_back(sample);
    }
  }

  // In ticks of 10 ms: an image is estimated when the IMU has extended that much beyond it.
  std::vector<VisionEstimate> of_dive() {
    use(OnLate::kBlock);
    std::vector<VisionEstimate> estimates;
    std::size_t imu = 0;
    std::size_t image = 0;
    const auto& images = recording_.cameras[0].images;
    for (now_ = kBegin; now_ <= kEnd + 200'000; now_ += 10'000) {
      for (; imu < recording_.imu.size() && recording_.imu[imu].utime <= now_; ++imu) {
        service_->add({&recording_.imu[imu], 1});
      }
      if (auto estimate = service_->poll(now_)) {
        if (estimate->fault != VisionFault::kNoImages) estimates.push_back(*estimate);
      }
      service_->observe(published());
      if (image == images.size() || images[image].utime != now_) continue;
      service_->add(recording_.depth[image]);
      service_->submit(*read_image(images[image], 0),
                       *read_image(recording_.cameras[1].images[image], 1), now_);
      ++image;
    }
    return estimates;
  }

  std::vector<VisionEstimate> of_recording() {
    now_ = kBegin;
    estimation::KnownStart start;
    start.utime = kBegin;
    start.X_WB = published().X_WB;
    start.v_WB_B = published().v_WB_B;
    start.yaw_sigma_deg = rad_to_deg(estimation::yaw_sigma(published()));
    start.tilt_sigma_deg = 0.5;
    start.speed_sigma = 0.05;
    estimation::VisionPipeline pipeline(options(), start, 1);
    // The service's first step has no image.
    estimation::VisionInput first;
    first.now = kBegin;
    first.imu = {recording_.imu[0]};
    std::ignore = pipeline.step(first);
    estimation::FeedOptions from;
    from.begin = kBegin + 1;
    estimation::RecordingFeed feed(recording_, from);
    std::vector<VisionEstimate> estimates;
    while (auto step = feed.next()) {
      step->input.expected_v_B = published().v_WB_B;
      estimates.push_back(pipeline.step(step->input));
    }
    return estimates;
  }

  estimation::Recording recording_;
};

TEST_F(SameInputs, GiveTheSameEstimatesInADiveAndOnARecording) {
  const std::vector<VisionEstimate> dive = of_dive();
  const std::vector<VisionEstimate> recording = of_recording();
  ASSERT_EQ(recording.size(), 41U);
  ASSERT_EQ(dive.size(), recording.size());
  for (std::size_t i = 0; i < dive.size(); ++i) {
    EXPECT_EQ(dive[i].fault, recording[i].fault) << i;
    EXPECT_EQ(dive[i].estimate.utime, recording[i].estimate.utime) << i;
    EXPECT_EQ(dive[i].estimate.X_WB.p, recording[i].estimate.X_WB.p) << i;
    EXPECT_EQ(dive[i].estimate.X_WB.q.coeffs(), recording[i].estimate.X_WB.q.coeffs()) << i;
    EXPECT_EQ(dive[i].estimate.covariance, recording[i].estimate.covariance) << i;
  }
  EXPECT_THAT(faults(dive), ::testing::Contains(VisionFault::kDark).Times(9));
  EXPECT_TRUE(dive.back().is_good());
}

}  // namespace
}  // namespace dive::mission
