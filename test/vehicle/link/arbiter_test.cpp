#include "vehicle/link/arbiter.h"

#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "test/vehicle/aqua2.h"
#include "vehicle/simulator/simulator.h"

namespace dive::link {
namespace {

using vehicle::ExitPath;
using vehicle::ExitPhase;

constexpr Utime kSecond = kMicrosecondsPerSecond;
constexpr Utime kTick = 20'000;
constexpr std::uint64_t kSession = 7;

VehicleCommand command_at(Utime utime, Source source = Source::kExecutive, double surge = 0.5) {
  VehicleCommand command;
  command.utime = utime;
  command.sequence = utime / kTick;
  command.source = source;
  command.session_id = kSession;
  command.rates.surge = surge;
  return command;
}

ImuSample level(Utime now) {
  ImuSample sample;
  sample.utime = now;
  return sample;
}

Pose place(double x, double y, double z) { return Pose{{x, y, z}}; }

TEST(Arbiter, ObeysTheNewestAndDropsWhatComesLate) {
  Arbiter arbiter;
  EXPECT_EQ(arbiter.step(level(0), DepthSample{0, 3.0}, 0).surge, 0.0)
      << "no command has arrived yet";
  EXPECT_TRUE(arbiter.receive(command_at(40'000, Source::kExecutive, 0.4), 40'000));
  EXPECT_FALSE(arbiter.receive(command_at(20'000, Source::kExecutive, 0.2), 41'000)) << "reordered";
  EXPECT_FALSE(arbiter.receive(command_at(40'000, Source::kExecutive, 0.2), 41'000)) << "twice";
  EXPECT_FALSE(arbiter.receive(command_at(60 * kSecond), 41'000)) << "of a time to come";
  EXPECT_EQ(arbiter.step(level(60'000), DepthSample{60'000, 3.0}, 60'000).surge, 0.4);
  EXPECT_EQ(arbiter.refused(), 3);
}

TEST(Arbiter, RefusesValuesThatAreNoCommand) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [](const std::function<void(VehicleCommand&)>& spoil) {
    VehicleCommand command = command_at(20'000);
    spoil(command);
    Arbiter arbiter;
    return !arbiter.receive(command, 20'000);
  };
  EXPECT_TRUE(refuses([&](VehicleCommand& c) { c.rates.yaw = nan; }));
  EXPECT_TRUE(refuses([&](VehicleCommand& c) { c.rates.pitch = 1.5; }));
  EXPECT_TRUE(refuses([&](VehicleCommand& c) { c.command.d = 1e9; }));
  EXPECT_TRUE(refuses([&](VehicleCommand& c) { c.command.v = nan; }));
  EXPECT_TRUE(refuses([&](VehicleCommand& c) { c.command.o.coeffs() *= 3.0; }));
  EXPECT_FALSE(refuses([&](VehicleCommand&) {}));
}

TEST(Arbiter, TheSupervisorOverridesTheExecutiveAndGivesBackWhenItFallsSilent) {
  Arbiter arbiter;
  arbiter.receive(command_at(kSecond, Source::kSupervisor, -0.3), kSecond);
  arbiter.receive(command_at(kSecond + 20'000), kSecond + 20'000);
  EXPECT_EQ(arbiter.source(kSecond + 20'000), Arbiter::CommandSource::kSupervisor);
  EXPECT_EQ(arbiter.step(level(0), DepthSample{}, kSecond + 20'000).surge, -0.3);
  arbiter.receive(command_at(kSecond + 320'000), kSecond + 320'000);
  EXPECT_EQ(arbiter.source(kSecond + 320'000), Arbiter::CommandSource::kExecutive);
}

TEST(Arbiter, AForgedTimeOrSequenceDoesNotShutOutTheExecutive) {
  for (const bool is_time : {true, false}) {
    Arbiter arbiter;
    EXPECT_TRUE(arbiter.receive(command_at(kSecond), kSecond));
    VehicleCommand forged = command_at(kSecond + kTick);
    (is_time ? forged.utime : forged.sequence) = 100'000'000'000'000'000;
    EXPECT_FALSE(arbiter.receive(forged, kSecond + kTick));
    EXPECT_TRUE(arbiter.receive(command_at(kSecond + kTick), kSecond + kTick));
  }
}

// The executive takes its time from the sensors: after their clock was set, a restarted one is
// 20 s behind, and after a restart of the driver the vehicle is.
TEST(Arbiter, ObeysARestartedExecutiveWhateverItsTime) {
  Arbiter arbiter;
  EXPECT_TRUE(arbiter.receive(command_at(60 * kSecond), 60 * kSecond));
  VehicleCommand restarted = command_at(40 * kSecond);
  restarted.session_id = kSession + 1;
  EXPECT_FALSE(arbiter.receive(restarted, 60 * kSecond + 400'000)) << "the first still commands";
  EXPECT_TRUE(arbiter.receive(restarted, 60 * kSecond + 600'000));
  Arbiter driver;
  EXPECT_TRUE(driver.receive(command_at(5'000 * kSecond), 2 * kTick)) << "a restarted driver";
  EXPECT_TRUE(driver.receive(command_at(5'000 * kSecond + kTick), 3 * kTick));
}

TEST(Arbiter, OfTwoExecutivesItObeysTheFirst) {
  Arbiter arbiter;
  for (Utime now = kSecond; now < 3 * kSecond; now += kTick) {
    EXPECT_TRUE(arbiter.receive(command_at(now), now));
    VehicleCommand second = command_at(now + 1'000);
    second.session_id = kSession + 1;
    EXPECT_FALSE(arbiter.receive(second, now + 1'000));
  }
}

// --- what it does by itself: the simulated vehicle under the arbiter's efforts ---

class Alone : public ::testing::Test {
 protected:
  Alone() : simulator_(testing::aqua2(), place(0, 0, -5), {}, 1) {}

  /// The executive swims east at 0.4 m/s for so long.
  void lead(double seconds, ExitPath path) {
    const Utime end = now() + from_seconds(seconds);
    while (now() < end) {
      VehicleCommand command = command_at(now() + kTick);
      command.mode = Mode::kDepthAndAngles;
      command.command.v = 0.4;
      command.command.d = 5.0;
      arbiter_.receive(command, now());
      path.X_WB = truth().X_WB;
      path.v_B = truth().v_WB_B - truth().X_WB.q.conjugate() *
                                      Eigen::Vector3d(path.current_W.x(), path.current_W.y(), 0.0);
      arbiter_.receive(ExitPathMessage{kSession, path});
      tick();
    }
  }

  void tick() {
    const vehicle::SensorSamples samples = simulator_.step(rates_);
    rates_ = arbiter_.step(samples.imu, samples.depth, now());
  }
  /// Runs until the phase, or for so long.
  void run_until(ExitPhase phase, double seconds) {
    const Utime end = now() + from_seconds(seconds);
    while (arbiter_.phase() != phase && now() < end) tick();
  }
  [[nodiscard]] const vehicle::GroundTruth& truth() const { return simulator_.truth(); }
  [[nodiscard]] Utime now() const { return truth().utime; }
  [[nodiscard]] double depth() const { return -truth().X_WB.p.z(); }

  vehicle::Simulator simulator_;
  Arbiter arbiter_;
  vehicle::PseudoRates rates_;
};

TEST_F(Alone, HoldsThenFollowsTheExitPathThenAscends) {
  ExitPath path;
  path.speed = 0.4;
  path.hold_s = 8.0;
  // Into the wreck it swam east; the way out is back west, then north.
  path.waypoints = {place(4, 0, -5), place(1, 0, -5), place(0, 3, -4.5)};
  path.revision = 1;
  lead(14.0, path);
  const Eigen::Vector3d left_at = truth().X_WB.p;
  run_until(ExitPhase::kHolding, 3.0);
  ASSERT_EQ(arbiter_.phase(), ExitPhase::kHolding);
  run_until(ExitPhase::kFollowing, 10.0);
  ASSERT_EQ(arbiter_.phase(), ExitPhase::kFollowing);
  EXPECT_LT((truth().X_WB.p - left_at).norm(), 0.9) << "it stopped";
  EXPECT_NEAR(depth(), 5.0, 0.3);
  run_until(ExitPhase::kAscending, 90.0);
  ASSERT_EQ(arbiter_.phase(), ExitPhase::kAscending);
  EXPECT_LT((truth().X_WB.p - Eigen::Vector3d(0, 3, -4.5)).norm(), 0.8) << truth().X_WB.p;
  for (int i = 0; i < 3000 && depth() > 0.3; ++i) tick();
  EXPECT_LT(depth(), 0.3);
}

TEST_F(Alone, FollowsTheExitPathInTheCurrentThatTheExecutiveMeasured) {
  const Eigen::Vector3d current_W(0.03, 0.05, 0.0);
  simulator_.set_current(current_W);
  ExitPath path;
  path.speed = 0.4;
  path.hold_s = 8.0;
  path.waypoints = {place(4, 0, -5), place(1, 0, -5), place(0, 3, -4.5)};
  path.revision = 1;
  path.current_W = current_W.head<2>();
  lead(14.0, path);
  run_until(ExitPhase::kAscending, 90.0);
  ASSERT_EQ(arbiter_.phase(), ExitPhase::kAscending);
  // Without the current it would be 2 m off after 40 s.
  EXPECT_LT((truth().X_WB.p - Eigen::Vector3d(0, 3, -4.5)).norm(), 0.8) << truth().X_WB.p;
}

TEST_F(Alone, InOpenWaterItHoldsThenAscendsWhereItIs) {
  ExitPath path;
  path.open_above = true;
  path.hold_s = 6.0;
  lead(10.0, path);
  const Eigen::Vector3d left_at = truth().X_WB.p;
  run_until(ExitPhase::kAscending, 60.0);
  ASSERT_EQ(arbiter_.phase(), ExitPhase::kAscending);
  // It stopped half a metre farther, and came back to where open water was known to be above.
  EXPECT_LT((truth().X_WB.p - left_at).head<2>().norm(), 0.6);
  for (int i = 0; i < 3000 && depth() > 0.3; ++i) tick();
  EXPECT_LT(depth(), 0.3);
}

TEST_F(Alone, WithoutAnExitPathItHoldsForLongAndThenAscends) {
  for (; now() < 2 * kSecond; tick()) arbiter_.receive(command_at(now() + kTick), now());
  const Utime silent = now();
  run_until(ExitPhase::kAscending, 60.0);
  ASSERT_EQ(arbiter_.phase(), ExitPhase::kAscending);
  EXPECT_GT(to_seconds(now() - silent), vehicle::ExitGuidance::kUnknownHold);
}

TEST_F(Alone, GivesWayToAnExecutiveThatSendsCommandsAgain) {
  ExitPath path;
  path.open_above = true;
  path.hold_s = 10.0;
  lead(5.0, path);
  run_until(ExitPhase::kHolding, 3.0);
  for (int i = 0; i < 150; ++i) tick();
  EXPECT_EQ(arbiter_.phase(), ExitPhase::kHolding);
  lead(3.0, path);
  EXPECT_EQ(arbiter_.phase(), ExitPhase::kIdle);
  EXPECT_EQ(arbiter_.source(now()), Arbiter::CommandSource::kExecutive);
}

TEST_F(Alone, IgnoresExitPathsOfOtherSessionsAndWithoutSense) {
  lead(1.0, {});
  ExitPath path;
  path.open_above = true;
  EXPECT_FALSE(arbiter_.receive(ExitPathMessage{kSession + 1, path}));
  EXPECT_TRUE(arbiter_.receive(ExitPathMessage{kSession, path}));
  path.hold_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(arbiter_.receive(ExitPathMessage{kSession, path}));
  path.hold_s = 5.0;
  path.current_W.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(arbiter_.receive(ExitPathMessage{kSession, path}));
  path.current_W.setZero();
  path.X_WB.p.x() = 1e300;
  EXPECT_FALSE(arbiter_.receive(ExitPathMessage{kSession, path}));
}

}  // namespace
}  // namespace dive::link
