#include "behaviors/stopping_speed.h"

#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "behaviors/view_speed_limit.h"

namespace dive::behaviors {
namespace {

using Eigen::Vector3d;

TEST(StoppingSpeed, WaitsForAScanAndForAFreshOne) {
  StoppingSpeed limit({});
  limit.advance(0, Vector3d::Zero());
  EXPECT_EQ(limit.max_command(0, 0.0), 0.0);
  limit.add_scan(0, 5.0);
  EXPECT_NEAR(limit.max_command(from_seconds(1.0), 0.0), 4.75 / 1.2, 1e-9);
  EXPECT_EQ(limit.max_command(from_seconds(1.02), 0.0), 0.0);
}

TEST(StoppingSpeed, BrakesWhatIsTooFast) {
  StoppingSpeed limit({});
  limit.advance(0, Vector3d::Zero());
  limit.add_scan(0, 0.25 + 1.2 * 0.3);
  EXPECT_NEAR(limit.max_command(0, 0.2), 0.3, 1e-9);
  EXPECT_NEAR(limit.max_command(0, 0.35), 0.15, 1e-9);
  EXPECT_EQ(limit.max_command(0, 0.5), 0.0);
}

TEST(StoppingSpeed, AnOptimistOnlyWantsToSeeAtAll) {
  StoppingSpeedOptions options;
  options.requires_observed_space = false;
  options.stale_s = 3.0;
  StoppingSpeed limit(options);
  limit.advance(0, Vector3d::Zero());
  EXPECT_EQ(limit.max_command(0, 0.0), 0.0);
  limit.add_scan(0, 0.0);
  EXPECT_TRUE(std::isinf(limit.max_command(from_seconds(3.0), 0.0)));
  EXPECT_EQ(limit.max_command(from_seconds(3.1), 0.0), 0.0);
}

// A vehicle that obeys after 0.2 s, with its own drag's time constant of 1 s, stops where a wall
// begins that was `seen` m away when it was first observed, however late scans arrive.
RC_GTEST_PROP(StoppingSpeed, StopsWithinWhatItHasSeen, ()) {
  const double wall = 0.01 * *rc::gen::inRange(30, 800);
  const int latency = *rc::gen::inRange(0, 15);  // ticks
  const int every = *rc::gen::inRange(1, 10);    // ticks
  StoppingSpeed limit({});
  std::vector<double> commands;
  std::vector<double> places;
  double x = 0.0;
  double v = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const Utime now = 20'000 * i;
    places.push_back(x);
    limit.advance(now, {x, 0, 0});
    if (i >= latency && i % every == 0) {
      const auto then = static_cast<std::size_t>(i - latency);
      limit.add_scan(20'000 * (i - latency), wall - places[then]);
    }
    commands.push_back(std::min(0.6, limit.max_command(now, v)));
    const double command = i >= 10 ? commands[static_cast<std::size_t>(i - 10)] : 0.0;
    v += 0.02 * (command - v) / 1.0;
    x += 0.02 * v;
  }
  RC_ASSERT(x < wall - 0.15);
  RC_ASSERT(x > wall - 0.26);  // and it does get there
}

TEST(StoppingSpeed, SubtractsTheDistanceSwumSinceALateScan) {
  StoppingSpeed limit({});
  for (int i = 0; i <= 40; ++i) limit.advance(20'000 * i, {0.01 * i, 0, 0});
  limit.add_scan(20'000 * 15, 2.0);
  EXPECT_NEAR(limit.max_command(20'000 * 40, 0.0), (2.0 - 0.25 - 0.25) / 1.2, 1e-9);
}

TEST(HoldSpeed, CommandsAgainstWhatIsMoreOrLessThanWasWanted) {
  const auto command_at = [](double surge, double wanted, double turn) {
    vehicle::Command command{wanted, 0.0, 2.0, from_rpy(0.1, 0.2, 3.0 + turn)};
    compensate_drift(surge, 3.0, command);
    return command;
  };
  const auto compensated = [&](double surge, double wanted, double turn = 0.0) {
    return command_at(surge, wanted, turn).v;
  };
  EXPECT_EQ(compensated(0.4, 0.4), 0.4);
  EXPECT_EQ(compensated(0.01, 0.0), 0.0) << "next to nothing";
  EXPECT_LT(compensated(0.1, 0.0), -0.1);
  EXPECT_GT(compensated(-0.1, 0.0), 0.1);
  EXPECT_GT(compensated(-0.1, 0.05), 0.15) << "it should swim ahead";
  EXPECT_GT(compensated(0.0, 0.14), 0.25) << "and be there soon";
  EXPECT_EQ(compensated(0.2, 0.4), 0.4) << "no faster than commanded, if that is fast";
  EXPECT_EQ(compensated(-0.15, -0.15), -0.15) << "astern on purpose";
  EXPECT_GT(compensated(-0.3, -0.15), -0.15);
  EXPECT_LT(compensated(0.1, -0.15), -0.15);
  for (const double turn : {-1.0, 1.0}) {
    EXPECT_LT(std::abs(compensated(0.05, 0.2, turn)), 0.1)
        << "way gathered in a turn becomes a slide";
    EXPECT_LT(std::abs(compensated(0.0, 0.2, turn)), 0.1);
    EXPECT_LT(std::abs(compensated(-0.05, -0.2, turn)), 0.1);
    EXPECT_LT(compensated(0.1, 0.0, turn), -0.1) << "but it is braked";
    EXPECT_GT(compensated(-0.1, 0.0, turn), 0.1);
    EXPECT_LT(compensated(0.3, 0.4, turn), -0.1) << "whatever was asked for";
    const auto turned = [&](double surge) {
      const Eigen::Vector3d rpy = to_rpy(command_at(surge, 0.2, turn).o);
      EXPECT_NEAR(rpy.x(), 0.1, 1e-9);
      EXPECT_NEAR(rpy.y(), 0.2, 1e-9);
      return wrap_angle(rpy.z() - 3.0);
    };
    EXPECT_NEAR(turned(0.3), 0.0, 1e-9) << "first it stops";
    EXPECT_NEAR(turned(-0.3), 0.0, 1e-9);
    EXPECT_NEAR(turned(0.05), turn, 1e-9) << "then it turns";
    EXPECT_NEAR(turned(-0.05), turn, 1e-9);
  }
  EXPECT_NEAR(wrap_angle(to_rpy(command_at(0.4, 0.4, 0.2).o).z() - 3.0), 0.2, 1e-9)
      << "a gentle turn is made under way";
  EXPECT_EQ(compensated(5.0, 0.0), -0.3);
  EXPECT_EQ(compensated(-5.0, 0.0), 0.3);
}

}  // namespace
}  // namespace dive::behaviors
