#include "mission/link/supervisor.h"

#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "test/vehicle/aqua2.h"
#include "vehicle/autopilot.h"
#include "vehicle/link/arbiter.h"
#include "vehicle/link/bus.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;
using vehicle::ExitPath;
using vehicle::ExitPhase;

constexpr Utime kSecond = kMicrosecondsPerSecond;
constexpr Utime kTick = 20'000;

/// An executive, a vehicle and the supervisor in simulated time. The vehicle swims as it is
/// commanded, at once.
class SupervisionTest : public ::testing::Test {
 protected:
  explicit SupervisionTest(const SupervisorSettings& settings = {}) : settings_(settings) {}

  /// Runs for so long; the executive sends commands while `commands_`.
  void run(double seconds) {
    for (const Utime end = now_ + from_seconds(seconds); now_ < end; now_ += kTick) {
      if (commands_) send(session_);
      move();
      if (has_sensors_) sense();
      const auto command = supervision_.step(now_);
      command_ = command;
      if (command) phases_.push_back(command->phase);
    }
  }
  void send(std::uint64_t session) {
    link::VehicleCommand command;
    command.utime = now_ + offset_;
    command.sequence = ++sequence_;
    command.session_id = session;
    supervision_.receive(command, now_);
    path_.X_WB.p = p_W_;
    supervision_.receive(link::ExitPathMessage{session, path_, map_digest_});
  }
  void move() {
    if (!command_) return;
    const double dt = to_seconds(kTick);
    yaw_ = to_rpy(command_->command.o).z();
    p_W_ += command_->command.v * dt * Eigen::Vector3d(std::cos(yaw_), std::sin(yaw_), 0.0);
    p_W_.z() += std::clamp(-command_->command.d - p_W_.z(), -0.2 * dt, 0.2 * dt);
  }
  void sense() {
    ImuSample imu;
    imu.utime = now_;
    imu.q_WB = from_rpy(0.0, 0.0, yaw_);
    supervision_.receive(imu, now_);
    if (has_depth_) supervision_.receive(DepthSample{now_, -p_W_.z()}, now_);
  }
  void finish(std::uint64_t session) {
    link::Heartbeat heartbeat;
    heartbeat.session_id = session;
    heartbeat.finished = true;
    supervision_.receive(heartbeat, now_);
  }
  [[nodiscard]] ExitPhase phase() const { return command_ ? command_->phase : ExitPhase::kIdle; }

  Utime now_ = 100 * kSecond;
  Utime offset_ = 0;  ///< Of the executive's clock.
  std::uint64_t session_ = 1;
  std::int64_t sequence_ = 0;
  bool commands_ = true;
  bool has_sensors_ = true;
  bool has_depth_ = true;
  Eigen::Vector3d p_W_{0, 0, -5};
  double yaw_ = 0.0;
  ExitPath path_ = {.revision = 1,
                    .hold_s = 10.0,
                    .speed = 0.4,
                    .waypoints = {Pose{{-1, 0, -5}}, Pose{{-4, 0, -4.5}}}};
  std::vector<std::string> said_;
  SupervisorLog log_ = [this](const std::string& line) { said_.push_back(line); };
  std::uint64_t map_digest_ = 7;  ///< Of the executive's map.
  SupervisorSettings settings_;
  Supervision supervision_{settings_, 99, log_};
  std::optional<link::VehicleCommand> command_;
  std::vector<ExitPhase> phases_;
};

TEST_F(SupervisionTest, OnlyWatchesWhileTheExecutiveSendsCommands) {
  run(20.0);
  EXPECT_TRUE(phases_.empty());
  finish(session_ + 1);
  run(1.0);
  EXPECT_FALSE(supervision_.is_over(now_)) << "another session has finished";
  finish(session_);
  run(1.0);
  EXPECT_FALSE(supervision_.is_over(now_)) << "it still sends commands: the report is forged";
  commands_ = false;
  run(0.8);
  EXPECT_TRUE(supervision_.is_over(now_));
  EXPECT_FALSE(supervision_.report().took_over);
  EXPECT_EQ(supervision_.report().holds, 0);
}

TEST_F(SupervisionTest, GivesAStalledExecutiveTheVehicleBack) {
  for (const double stall_s : {0.7, 1.5, 9.0}) {
    run(2.0);
    commands_ = false;
    run(stall_s);
    EXPECT_EQ(phase(), stall_s > 1.0 ? ExitPhase::kHolding : ExitPhase::kIdle);
    commands_ = true;
    run(1.0);
    EXPECT_EQ(phase(), ExitPhase::kIdle);
  }
  const SupervisorReport report = supervision_.report();
  EXPECT_EQ(report.holds, 2);
  EXPECT_EQ(report.given_back, 2);
  EXPECT_EQ(report.restarts, 0);
  EXPECT_FALSE(report.took_over);
  EXPECT_THAT(said_.at(1), HasSubstr("sends commands again"));
  for (const ExitPhase phase : phases_) EXPECT_EQ(phase, ExitPhase::kHolding);
  EXPECT_NEAR(p_W_.z(), -5.0, 1e-6) << "it keeps its depth";
}

TEST_F(SupervisionTest, GivesARestartedExecutiveWithAnotherClockTheVehicleBack) {
  run(2.0);
  commands_ = false;
  run(2.0);
  session_ = 2;
  sequence_ = 0;
  offset_ = -20 * kSecond;
  commands_ = true;
  run(2.0);
  EXPECT_EQ(phase(), ExitPhase::kIdle);
  EXPECT_EQ(supervision_.report().restarts, 1);
  EXPECT_EQ(supervision_.report().given_back, 1);
  EXPECT_THAT(said_.back(), HasSubstr("was restarted"));
}

TEST_F(SupervisionTest, OneCommandIsNoRecovery) {
  run(2.0);
  commands_ = false;
  run(2.0);
  send(session_);
  run(1.0);
  EXPECT_EQ(phase(), ExitPhase::kHolding);
  EXPECT_EQ(supervision_.report().given_back, 0);
}

TEST_F(SupervisionTest, FollowsTheExitPathOfAnExecutiveThatDoesNotComeBackThenAscends) {
  run(2.0);
  commands_ = false;
  run(10.9);
  EXPECT_EQ(phase(), ExitPhase::kHolding);
  run(1.0);
  EXPECT_EQ(phase(), ExitPhase::kFollowing);
  run(25.0);
  EXPECT_EQ(phase(), ExitPhase::kAscending);
  EXPECT_LT((p_W_.head<2>() - Eigen::Vector2d(-4, 0)).norm(), 0.8) << p_W_.transpose();
  commands_ = true;
  run(5.0);
  EXPECT_EQ(phase(), ExitPhase::kAscending) << "the executive's position is wrong by now";
  commands_ = false;
  run(30.0);
  EXPECT_TRUE(supervision_.is_over(now_));
  const SupervisorReport report = supervision_.report();
  EXPECT_TRUE(report.took_over && report.followed && report.surfaced);
  EXPECT_FALSE(report.blindly || report.presumed);
}

/// A supervisor with a map.
class SupervisionWithAMap : public SupervisionTest {
 protected:
  SupervisionWithAMap() : SupervisionTest({.map = SupervisedMap{.digest = 7}}) {}

  /// A scan of now that shows the vehicle 0.2 m further along y than it is by dead reckoning.
  void fix() {
    MapFix fix;
    fix.scan_utime = now_ - kTick;
    fix.position_W = p_W_.head<2>() + Eigen::Vector2d(0.0, 0.2);
    fix.information.diagonal().head<2>().setConstant(1e6);
    supervision_.receive(fix);
  }
};

TEST_F(SupervisionWithAMap, UsesPositionFixesWhileItHoldsOrFollows) {
  run(2.0);
  EXPECT_FALSE(supervision_.wants_fixes());
  fix();
  EXPECT_EQ(supervision_.report().fixes, 0);
  commands_ = false;
  run(2.0);
  int proposed = 0;
  bool has_followed = false;
  while (supervision_.wants_fixes()) {
    ASSERT_LT(proposed, 200);
    fix();
    EXPECT_EQ(supervision_.report().fixes, ++proposed);
    has_followed |= phase() == ExitPhase::kFollowing;
    run(0.5);
  }
  EXPECT_TRUE(has_followed);
  EXPECT_EQ(phase(), ExitPhase::kAscending);
  EXPECT_NEAR(p_W_.y(), -0.2, 0.1) << "it has corrected what the fixes show";
}

TEST_F(SupervisionWithAMap, SaysSoAndUsesNoneIfTheExecutiveHasAnother) {
  map_digest_ = 8;
  run(2.0);
  ASSERT_EQ(said_.size(), 1U);
  EXPECT_THAT(said_.at(0), HasSubstr("another map"));
  commands_ = false;
  run(2.0);
  EXPECT_FALSE(supervision_.wants_fixes());
  fix();
  EXPECT_EQ(supervision_.report().fixes, 0);
}

/// The supervisor of a vehicle that needs less effort for a speed than the Aqua2.
class SupervisionOfAFastVehicle : public SupervisionTest {
 protected:
  SupervisionOfAFastVehicle() : SupervisionTest({.motion = {.full_speed = 1.6}}) {}
};

TEST_F(SupervisionOfAFastVehicle, EndsWhereItsPathEnds) {
  run(2.0);
  commands_ = false;
  run(60.0);
  EXPECT_TRUE(supervision_.report().followed);
  EXPECT_EQ(phase(), ExitPhase::kAscending);
  EXPECT_FALSE(supervision_.report().blindly);
  EXPECT_LT((p_W_.head<2>() - Eigen::Vector2d(-4, 0)).norm(), 0.8) << p_W_.transpose();
}

TEST_F(SupervisionTest, AscendsAtOnceInOpenWaterAndLateWhereNothingIsKnown) {
  path_.waypoints.clear();
  path_.open_above = true;
  path_.hold_s = 3.0;
  run(2.0);
  commands_ = false;
  run(4.5);
  EXPECT_EQ(phase(), ExitPhase::kAscending);
  EXPECT_FALSE(supervision_.report().blindly);

  Supervision unknown({}, 99, log_);
  link::VehicleCommand command;
  command.utime = command.sequence = 1;
  unknown.receive(command, now_);
  std::optional<link::VehicleCommand> last;
  double held_s = 0.0;
  for (int i = 0; i < 5000 && !unknown.report().blindly; ++i, now_ += kTick, held_s += 0.02) {
    last = unknown.step(now_);
    ImuSample imu;
    imu.utime = now_;
    unknown.receive(imu, now_);
    unknown.receive(DepthSample{now_, 5.0}, now_);
  }
  EXPECT_TRUE(unknown.report().blindly);
  EXPECT_GT(held_s, vehicle::ExitGuidance::kUnknownHold);
}

TEST_F(SupervisionTest, AForgedCommandDoesNotShutOutTheExecutive) {
  run(2.0);
  link::VehicleCommand forged;
  forged.utime = 100'000'000'000'000'000;
  forged.sequence = sequence_ + 1;
  forged.session_id = session_;
  supervision_.receive(forged, now_);
  run(5.0);
  EXPECT_TRUE(phases_.empty()) << "the executive sends commands";
  EXPECT_EQ(supervision_.report().refused, 1);
}

TEST_F(SupervisionTest, ReportsASecondExecutiveAndObeysTheFirst) {
  run(2.0);
  for (int i = 0; i < 100; ++i) {
    run(0.02);
    send(2);
  }
  EXPECT_TRUE(supervision_.report().second_executive);
  EXPECT_EQ(std::ranges::count_if(
                said_, [](const auto& line) { return line.starts_with("a second executive"); }),
            1);
  commands_ = false;
  for (int i = 0; i < 100; ++i) {
    run(0.02);
    send(2);
  }
  EXPECT_EQ(supervision_.report().restarts, 1) << "the first has ended";
}

TEST_F(SupervisionTest, WithoutADepthSensorTheSurfaceIsPresumed) {
  path_.waypoints.clear();
  path_.open_above = true;
  path_.hold_s = 3.0;
  run(2.0);
  commands_ = has_depth_ = false;
  run(10.0);
  EXPECT_EQ(phase(), ExitPhase::kAscending);
  EXPECT_FALSE(supervision_.is_over(now_));
  run(120.0);
  EXPECT_TRUE(supervision_.is_over(now_));
  EXPECT_TRUE(supervision_.report().presumed);
  EXPECT_FALSE(supervision_.report().surfaced);
}

/// The supervisor beside the simulated vehicle with its own autopilot, in still water, without
/// sensor errors; the executive knows the true pose and velocity until it is killed.
struct SimulatedDive {
  void lead(double seconds) {
    for (const Utime end = now() + from_seconds(seconds); now() < end;) {
      const double turning_s = std::max(to_seconds(now()) - 10.0, 0.0);
      link::VehicleCommand command;
      command.command.v = 0.4;
      command.command.d = 8.0 - 0.12 * turning_s;
      command.command.o = from_rpy(0.0, 0.0, 0.4 * turning_s);
      if (samples.imu && samples.depth) {
        command.rates = executive.step(command.command, samples.imu->q_WB, samples.imu->gyro_B,
                                       samples.depth->depth_m, to_seconds(kTick));
      }
      command.utime = now();
      command.sequence = ++sequence;
      command.session_id = 1;
      arbiter.receive(command, now());
      supervision.receive(command, now());
      path.X_WB = simulator.truth().X_WB;
      path.v_B = simulator.truth().v_WB_B;
      if (sequence % 5 == 0) supervision.receive(link::ExitPathMessage{1, path});
      tick();
    }
  }
  void tick() {
    samples = simulator.step(arbiter.step(samples.imu, samples.depth, now()));
    supervision.receive(*samples.imu, now());
    supervision.receive(*samples.depth, now());
    if (sequence > 0 && now() % 40'000 == 0) {
      own = supervision.step(now());
      if (own) arbiter.receive(*own, now());
    }
  }
  [[nodiscard]] Utime now() const { return simulator.truth().utime; }

  vehicle::Simulator simulator{dive::testing::aqua2(), Pose{{0, 0, -8}}, dive::testing::ideal(), 1};
  vehicle::Autopilot executive{vehicle::AutopilotOptions{}};
  link::Arbiter arbiter;
  SupervisorLog log = [](const std::string&) {};
  Supervision supervision{{}, 99, log};
  vehicle::SensorSamples samples;
  std::optional<link::VehicleCommand> own;  ///< The supervisor's command.
  std::int64_t sequence = 0;
  ExitPath path = {.revision = 1,
                   .hold_s = 4.0,
                   .speed = 0.4,
                   .waypoints = {Pose{{4, 1, -6}}, Pose{{0, 4, -5}}, Pose{{-4, 4, -5}}}};
};

// A mission that ends in a turn, while it rises: the vehicle coasts sideways and upwards.
TEST(Supervision, BringsAVehicleThatTurnsAndHeavesToTheEndOfItsExitPath) {
  SimulatedDive dive;
  dive.lead(14.0);
  while (dive.now() < 120 * kSecond && (!dive.own || dive.own->phase != ExitPhase::kAscending)) {
    dive.tick();
  }
  ASSERT_TRUE(dive.own);
  EXPECT_EQ(dive.own->phase, ExitPhase::kAscending);
  const Eigen::Vector3d& p_W = dive.simulator.truth().X_WB.p;
  EXPECT_LT((p_W - Eigen::Vector3d(-4, 4, -5)).norm(), 0.3) << p_W.transpose();
}

/// A simulated clock: time passes only during waits.
class WaitedClock final : public Clock {
 public:
  [[nodiscard]] Utime now() override { return now_; }
  [[nodiscard]] Utime real(Utime duration) const override {
    now_ += duration;
    return 0;
  }

 private:
  mutable Utime now_ = 0;
};

// The same over a bus.
TEST(Supervisor, OverTheBusItHoldsWithin2SecondsOfSilenceAndBringsTheVehicleUp) {
  const std::string url =
      fmt::format("udpm://239.255.76.67:{}?ttl=0", 51'000 + ::getpid() % 10'000);
  auto vehicle = link::Bus::open(url);
  auto supervisor = link::Bus::open(url);
  if (!vehicle || !supervisor) GTEST_SKIP() << "no multicast on this machine";
  bool is_commanded = false;
  vehicle->listen<link::VehicleCommand>(
      link::channel::kCommand, [&](const link::VehicleCommand& command) {
        is_commanded |= command.source == link::Source::kSupervisor;
      });

  // One command, received when the supervisor listens, and no new one afterwards; then a vehicle
  // that is at the surface.
  link::Packet command;
  link::Packet ahrs;
  link::Packet depth;
  ASSERT_TRUE(link::encode(
      link::VehicleCommand{1, 1, link::Source::kExecutive, link::Mode::kRates, {}, {}}, command));
  ASSERT_TRUE(link::encode(ImuSample{.utime = 1}, ahrs));
  ASSERT_TRUE(link::encode(DepthSample{.utime = 1, .depth_m = 0.1}, depth));
  // The supervisor's clock does not wait for the thread that receives packets: the last one of each
  // round shows that all have arrived.
  const char* const kLast = "DIVE_TEST_LAST";
  int rounds = 0;
  int arrived = 0;
  supervisor->listen<DepthSample>(kLast, [&](const DepthSample&) { ++arrived; });
  SteadyClock steady;
  const Utime without_multicast = steady.now() + 60 * kSecond;
  WaitedClock clock;
  const SupervisorReport report = supervise(
      {}, *supervisor, clock, [](const std::string&) {},
      [&] {
        vehicle->publish(link::channel::kCommand, command);
        vehicle->publish(link::channel::kAhrs, ahrs);
        vehicle->publish(link::channel::kDepth, depth);
        vehicle->publish(kLast, depth);
        ++rounds;
        vehicle->wait(steady, steady.now());
        return supervisor->wait(steady, without_multicast, [&] { return arrived == rounds; });
      });
  if (report.holds == 0) GTEST_SKIP() << "no multicast on this machine";
  if (!is_commanded) {
    vehicle->wait(steady, steady.now() + 60 * kSecond, [&] { return is_commanded; });
  }
  EXPECT_GT(report.silent_s, 1.0);
  EXPECT_LT(report.silent_s, 2.0);
  EXPECT_TRUE(is_commanded);
  EXPECT_TRUE(report.surfaced);
}

}  // namespace
}  // namespace dive::mission
