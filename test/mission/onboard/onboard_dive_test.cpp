// The loop on board with a vehicle that writes down what is asked of it.

#include "mission/onboard/onboard_dive.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dive::mission {
namespace {

using ::testing::ElementsAre;

// Holds in open water until its mission_timeout, and surfaces.
constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="test">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map file="none.sdf"/>
  <start x="0" y="0" z="3" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="6" min_altitude="0.3" clearance="0.6" mission_timeout="20"
          battery_reserve="0.2"/>
  <states initial="go">
    <goto id="go" x="6" y="0" z="3" z_units="DEPTH" capture_radius="0.5" timeout="15"
          on_timeout="ascend"/>
    <surface id="ascend">
      <transition event="done.state.ascend" target="surfaced"/>
    </surface>
    <final id="surfaced"/>
  </states>
</mission>)";

/// Stays where it is, 3 m deep.
class LazyVehicle final : public VehiclePort {
 public:
  [[nodiscard]] Utime begin() override {
    calls.emplace_back("begin");
    return began;
  }
  [[nodiscard]] std::optional<Utime> wait_for_tick() override {
    calls.emplace_back("wait_for_tick");
    if (ticks == last_tick) return std::nullopt;
    ++ticks;
    return began + ticks * kControlPeriod;
  }
  void sense(StepInputs& inputs) override {
    calls.emplace_back("sense");
    const double noise = ticks % 2 == 0 ? 0.0 : 1e-3;  // a sensor that works is never quite still
    ImuSample imu;
    imu.utime = inputs.now;
    imu.q_WB = from_rpy(0.0, 0.0, noise);
    imu.accel_B.z() = 9.81;
    inputs.imu = imu;
    inputs.depth = DepthSample{inputs.now, 3.0 + noise};
    inputs.health = HealthSample{inputs.now, 0.9, 20.0, false};
  }
  void amend(StepInputs& inputs) override {
    calls.emplace_back("amend");
    plan_answered = plan_answered || inputs.plan.has_value();
  }
  void command(const StepOutputs& /*outputs*/) override {
    calls.emplace_back("command");
    was_kept_first = was_kept_first && kept == ticks;
  }
  [[nodiscard]] std::optional<RangeScan> take_scan() override {
    calls.emplace_back("take_scan");
    return std::nullopt;
  }
  [[nodiscard]] std::vector<ImuSample> take_imu_samples() override {
    calls.emplace_back("take_imu_samples");
    return {};
  }
  [[nodiscard]] StereoPair take_images() override {
    calls.emplace_back("take_images");
    return {};
  }
  void end_tick(const StepInputs& /*inputs*/, const StepOutputs& /*outputs*/) override {
    calls.emplace_back("end_tick");
  }

  Utime began = 0;
  std::int64_t last_tick = -1;  ///< -1: no end.
  std::int64_t ticks = 0;
  std::int64_t kept = 0;
  std::vector<std::string> calls;
  bool plan_answered = false;
  bool was_kept_first = true;
};

class OnboardDiveTest : public ::testing::Test {
 protected:
  void SetUp() override {
    Diagnostics diagnostics;
    model_ = *vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
    mission_ = *parse_mission(SourceText("test.xml", kMission), diagnostics, MapFile::kNotNeeded);
  }

  OnboardReport dive() {
    OnboardDive dive(mission_, {}, model_, {}, std::nullopt, OnLate::kBlock);
    return dive.run(vehicle_, [&](const Executive&, const StepOutputs&) { ++vehicle_.kept; });
  }

  vehicle::Model model_;
  Mission mission_;
  LazyVehicle vehicle_;
};

TEST_F(OnboardDiveTest, AsksForSamplesBeforeTheStepAndCommandsAfterIt) {
  vehicle_.last_tick = 1;
  const OnboardReport report = dive();
  EXPECT_THAT(vehicle_.calls, ElementsAre("begin", "wait_for_tick", "sense", "amend", "command",
                                          "take_scan", "end_tick", "wait_for_tick"));
  EXPECT_EQ(report.executive.outcome, Outcome::kRunning);
}

// Actions are in the journal before the command is sent: a restart must not repeat them.
TEST_F(OnboardDiveTest, KeepsEachStepBeforeItsCommand) {
  vehicle_.last_tick = 50;
  static_cast<void>(dive());
  EXPECT_EQ(vehicle_.kept, 50);
  EXPECT_TRUE(vehicle_.was_kept_first);
}

TEST_F(OnboardDiveTest, AnswersAPlanQueryAndCountsIt) {
  vehicle_.last_tick = 20;
  const OnboardReport report = dive();
  EXPECT_TRUE(vehicle_.plan_answered);
  EXPECT_EQ(report.plans, 1);
  EXPECT_EQ(report.replans, 0);
}

// Times are those of the dive, whatever the vehicle's clock shows.
TEST_F(OnboardDiveTest, EndsWhenTheLongestDiveIsOver) {
  vehicle_.began = from_seconds(1e6);
  const OnboardReport report = dive();
  EXPECT_EQ(report.executive.outcome, Outcome::kRunning) << "the vehicle never comes up";
  EXPECT_NEAR(to_seconds(vehicle_.ticks * kControlPeriod), longest_dive_s(mission_), 0.03);
  ASSERT_FALSE(report.transitions.empty());
  EXPECT_NEAR(report.transitions.front().t_s, 0.02, 1e-9);
  EXPECT_FALSE(report.failsafes.empty()) << "it was out of time";
}

}  // namespace
}  // namespace dive::mission
