// Images and IMU samples as they arrive over a link: late, duplicate, out of order, by a clock that
// is set, or not at all.

#include "mission/link/camera_inbox.h"

#include <initializer_list>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dive::mission {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Utime kMs = 1000;
constexpr Utime kSecond = kMicrosecondsPerSecond;
constexpr Utime kPeriod = 50 * kMs;

ImageFrame image(int camera, Utime utime) {
  return {utime, camera, ImageFrame::Format::kGray8, 2, 1, {1, 2}};
}

ImuSample inertial(Utime utime) {
  ImuSample sample;
  sample.utime = utime;
  return sample;
}

std::vector<Utime> stamps(const std::vector<ImuSample>& samples) {
  std::vector<Utime> result;
  for (const ImuSample& sample : samples) result.push_back(sample.utime);
  return result;
}

/// Stamps of the next pair; -1 for an absent image.
std::vector<Utime> next(CameraInbox& inbox, Utime now) {
  const StereoPair pair = inbox.take_pair(now);
  return {pair.left ? pair.left->utime : -1, pair.right ? pair.right->utime : -1};
}

/// On a link without latency, with sensors on our clock.
class CameraInboxTest : public ::testing::Test {
 protected:
  CameraInboxTest() {
    inbox_.add(inertial(0), 0);
    static_cast<void>(inbox_.take_inertial());
  }
  void see(int camera, Utime utime) { see(camera, utime, utime); }
  void see(int camera, Utime utime, Utime arrived) { inbox_.add(image(camera, utime), arrived); }

  CameraInbox inbox_;
};

TEST_F(CameraInboxTest, PairsWhatWasTakenTogetherWhicheverCameFirst) {
  see(0, kPeriod);
  see(1, kPeriod + 900);
  EXPECT_THAT(next(inbox_, kPeriod + kMs), ElementsAre(kPeriod, kPeriod + 900));
  see(1, 2 * kPeriod);
  EXPECT_THAT(next(inbox_, 2 * kPeriod), ElementsAre(-1, -1));
  see(0, 2 * kPeriod + 900);
  see(2, 2 * kPeriod + 900);  // the back camera, which is not used
  EXPECT_THAT(next(inbox_, 2 * kPeriod + kMs), ElementsAre(2 * kPeriod + 900, 2 * kPeriod));
  EXPECT_THAT(next(inbox_, 3 * kPeriod), ElementsAre(-1, -1)) << "each is handed on once";
  EXPECT_EQ(inbox_.stats().pairs, 2);
  EXPECT_EQ(inbox_.stats().images_dropped, 0);
}

TEST_F(CameraInboxTest, ALeftImageWaitsForItsRightOneAndThenGoesAlone) {
  see(0, kPeriod);
  EXPECT_THAT(next(inbox_, kPeriod + CameraInbox::kPatience - 1), ElementsAre(-1, -1));
  EXPECT_THAT(next(inbox_, kPeriod + CameraInbox::kPatience), ElementsAre(kPeriod, -1));
  see(1, kPeriod, 3 * kPeriod);  // the delayed right image
  EXPECT_EQ(inbox_.stats().images_dropped, 1);
  see(0, 4 * kPeriod);
  see(0, 5 * kPeriod);  // the next left image arrives: the previous right image is lost
  EXPECT_THAT(next(inbox_, 5 * kPeriod), ElementsAre(4 * kPeriod, -1));
  see(1, 6 * kPeriod);
  EXPECT_THAT(next(inbox_, 6 * kPeriod), ElementsAre(5 * kPeriod, -1));
  see(0, 6 * kPeriod);
  EXPECT_THAT(next(inbox_, 6 * kPeriod), ElementsAre(6 * kPeriod, 6 * kPeriod));
  EXPECT_EQ(inbox_.stats().unpaired, 3);
  EXPECT_EQ(inbox_.stats().pairs, 1);
}

TEST_F(CameraInboxTest, WithoutALeftImageThereIsNoneAndNothingPilesUp) {
  for (int i = 1; i <= 100; ++i) {
    see(1, i * kPeriod);
    EXPECT_THAT(next(inbox_, i * kPeriod), ElementsAre(-1, -1));
  }
  EXPECT_EQ(inbox_.stats().images_dropped, 98);
}

TEST_F(CameraInboxTest, KeepsTheNewestWhenNobodyTakesThem) {
  for (int i = 1; i <= 10; ++i) {
    see(0, i * kPeriod);
    see(1, i * kPeriod);
  }
  EXPECT_THAT(next(inbox_, kSecond), ElementsAre(9 * kPeriod, 9 * kPeriod));
  EXPECT_THAT(next(inbox_, kSecond), ElementsAre(10 * kPeriod, 10 * kPeriod));
  EXPECT_EQ(inbox_.stats().images_dropped, 16);
}

TEST_F(CameraInboxTest, TakesNoImageTwiceNorOneThatWasOvertaken) {
  see(0, 2 * kPeriod, 2 * kPeriod);
  see(0, 2 * kPeriod, 2 * kPeriod + kMs);
  see(0, kPeriod, 2 * kPeriod + 2 * kMs);  // late, but within the limit
  see(1, kPeriod, 2 * kPeriod + 3 * kMs);
  EXPECT_THAT(next(inbox_, 3 * kPeriod), ElementsAre(kPeriod, kPeriod));
  EXPECT_THAT(next(inbox_, 4 * kPeriod), ElementsAre(2 * kPeriod, -1));
  see(0, kPeriod, 4 * kPeriod);
  see(0, 2 * kPeriod, 4 * kPeriod);
  EXPECT_THAT(next(inbox_, 5 * kPeriod), ElementsAre(-1, -1));
  EXPECT_EQ(inbox_.stats().images_dropped, 3);
}

TEST_F(CameraInboxTest, PutsInertialSamplesInARowEachOnce) {
  for (const int ms : {5, 15, 10, 15, 20}) inbox_.add(inertial(ms * kMs), 20 * kMs);
  EXPECT_THAT(stamps(inbox_.take_inertial()), ElementsAre(5 * kMs, 10 * kMs, 15 * kMs, 20 * kMs));
  for (const int ms : {20, 18, 25}) inbox_.add(inertial(ms * kMs), 40 * kMs);
  EXPECT_THAT(stamps(inbox_.take_inertial()), ElementsAre(25 * kMs));
  EXPECT_THAT(inbox_.take_inertial(), IsEmpty());
  EXPECT_EQ(inbox_.stats().imu_samples_dropped, 3);
}

TEST_F(CameraInboxTest, AFloodOfInertialSamplesIsBounded) {
  for (int i = 1; i <= 1000; ++i) inbox_.add(inertial(i), kPeriod);
  const std::vector<ImuSample> kept = inbox_.take_inertial();
  EXPECT_EQ(kept.size(), CameraInbox::kMaxImuSamples);
  EXPECT_EQ(kept.back().utime, 1000);
  EXPECT_EQ(inbox_.stats().imu_samples_dropped,
            1000 - static_cast<int>(CameraInbox::kMaxImuSamples));
}

TEST(CameraInboxClock, IsThatOfTheInertialUnitForTheImagesToo) {
  const Utime boot = 1'700'000'000 * kSecond;  // stamps are the time of day
  CameraInbox inbox;
  inbox.add(image(0, boot), kSecond);
  EXPECT_THAT(next(inbox, kSecond), ElementsAre(-1, -1)) << "by a clock that is not known yet";
  inbox.add(inertial(boot), kSecond);
  inbox.add(image(0, boot + 10 * kMs), kSecond + 90 * kMs);
  inbox.add(image(1, boot + 10 * kMs), kSecond + 120 * kMs);
  EXPECT_THAT(next(inbox, kSecond + 120 * kMs),
              ElementsAre(kSecond + 10 * kMs, kSecond + 10 * kMs));
  inbox.add(image(0, boot + kPeriod), kSecond + kPeriod + 501 * kMs);
  EXPECT_EQ(inbox.stats().images_dropped, 2) << "too long under way";
  EXPECT_EQ(inbox.clock_jumps(), 0);
}

TEST(CameraInboxClock, AImageNeverSetsIt) {
  for (const Utime jump : {-3600 * kSecond, 3600 * kSecond, Utime{1} << 62, -(Utime{1} << 62)}) {
    CameraInbox inbox;
    inbox.add(inertial(0), 0);
    inbox.add(image(0, kSecond + jump), kSecond);
    inbox.add(inertial(kSecond), kSecond);
    EXPECT_EQ(inbox.clock_jumps(), 0) << jump;
    EXPECT_THAT(stamps(inbox.take_inertial()), ElementsAre(0, kSecond));
    inbox.add(inertial(2 * kSecond + jump / 2), 2 * kSecond);  // the clock has been set
    EXPECT_EQ(inbox.clock_jumps(), 1) << jump;
  }
}

TEST(CameraInboxInLockStep, IsWholeOnceAllOfATickHasCome) {
  CameraInbox inbox;
  link::SimTick tick;
  tick.utime = 40 * kMs;
  tick.left = tick.right = 40 * kMs;
  tick.imu_samples = 2;
  tick.last_imu = 20 * kMs;
  const auto add = [&](auto sample) {
    EXPECT_FALSE(inbox.has(tick));
    inbox.add(sample, std::nullopt);
    inbox.add(sample, std::nullopt);  // every message is repeated
  };
  add(inertial(20 * kMs));
  add(image(1, 40 * kMs));
  add(inertial(15 * kMs));
  add(image(0, 40 * kMs));
  EXPECT_TRUE(inbox.has(tick));
  EXPECT_THAT(stamps(inbox.take_inertial()), ElementsAre(15 * kMs, 20 * kMs));
  const StereoPair pair = inbox.take_pair(tick);
  EXPECT_TRUE(pair.left && pair.right);
  inbox.add(image(0, 40 * kMs), std::nullopt);

  link::SimTick one_eyed;
  one_eyed.utime = 100 * kMs;
  one_eyed.left = 100 * kMs;
  EXPECT_FALSE(inbox.has(one_eyed));
  inbox.add(image(0, 100 * kMs), std::nullopt);
  EXPECT_TRUE(inbox.has(one_eyed));
  const StereoPair left = inbox.take_pair(one_eyed);
  EXPECT_TRUE(left.left && !left.right);
  link::SimTick blind;
  blind.utime = 120 * kMs;
  EXPECT_TRUE(inbox.has(blind));
  EXPECT_FALSE(inbox.take_pair(blind).left);
}

}  // namespace
}  // namespace dive::mission
