#include "mission/link/supervisor.h"

#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "vehicle/link/bus.h"

namespace dive::mission {
namespace {

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

TEST(Supervisor, TakesOverWithin2SecondsOfSilenceAndBringsTheVehicleUp) {
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
  link::Packet depth;
  ASSERT_TRUE(link::encode(
      link::VehicleCommand{1, 1, link::Source::kExecutive, link::Mode::kRates, {}, {}}, command));
  ASSERT_TRUE(link::encode(DepthSample{.utime = 1, .depth_m = 0.1}, depth));
  SteadyClock steady;
  const Utime without_multicast = steady.now() + 60 * kMicrosecondsPerSecond;
  WaitedClock clock;
  const SupervisorReport report = supervise(
      {}, *supervisor, clock, [](const std::string&) {},
      [&] {
        vehicle->publish(link::channel::kCommand, command);
        vehicle->publish(link::channel::kDepth, depth);
        vehicle->wait(steady, steady.now());
        return steady.now() < without_multicast;
      });
  if (!report.took_over) GTEST_SKIP() << "no multicast on this machine";
  vehicle->wait(steady, steady.now() + 60 * kMicrosecondsPerSecond, [&] { return is_commanded; });
  EXPECT_GT(report.silent_s, 1.0);
  EXPECT_LT(report.silent_s, 2.0);
  EXPECT_TRUE(is_commanded);
  EXPECT_TRUE(report.surfaced);
}

}  // namespace
}  // namespace dive::mission
