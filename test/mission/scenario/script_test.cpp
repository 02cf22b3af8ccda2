// The script of a scenario: when its steps are executed, and their effect on the inputs.

#include "mission/scenario/script.h"

#include <gtest/gtest.h>

#include "vehicle/model.h"

namespace dive::mission {
namespace {

using Kind = Occurrence::Kind;

vehicle::Model aqua2() {
  Diagnostics diagnostics;
  return vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics).value();
}

class ScriptPlayed : public ::testing::Test {
 protected:
  void play(const std::string& steps, Script script = Script::kPlayed) {
    Diagnostics diagnostics;
    const std::string text = "<scenario xmlns=\"urn:dive:scenario:1\" id=\"s\" mission=\"m.xml\">" +
                             steps + "<expect><outcome is=\"success\"/></expect></scenario>";
    scenario_ = parse_scenario(SourceText("s.xml", text), diagnostics).value();
    player_.emplace(scenario_, record_, script);
  }

  // One tick with a sample of every kind.
  StepInputs tick(double t_s) {
    StepInputs inputs;
    inputs.now = from_seconds(t_s);
    inputs.imu.emplace();
    inputs.depth.emplace();
    inputs.health.emplace();
    inputs.plan.emplace();
    appearing_.clear();
    player_->play({inputs, faults_, simulator_, appearing_});
    vehicle::GroundTruth truth;
    truth.utime = inputs.now;
    faults_.apply(truth, inputs, appearing_);
    return inputs;
  }

  void happens(Kind kind, double t_s, const std::string& name) {
    record_.occurrences.push_back({kind, t_s, name});
  }

  Scenario scenario_;
  DiveRecord record_;
  std::optional<ScriptPlayer> player_;
  FaultInjector faults_{{}};
  std::vector<AppearingObstacle> appearing_;  ///< In the last tick.
  vehicle::Simulator simulator_{aqua2(), Pose{}, vehicle::Conditions{}, 1};
};

const std::string kAbort = "><operator command=\"abort\"/></at>";

TEST_F(ScriptPlayed, AStepHappensOnceAtItsTime) {
  play("<at time=\"2\" id=\"now\"" + kAbort);
  EXPECT_FALSE(tick(1.98).operator_command);
  EXPECT_EQ(tick(2.0).operator_command, OperatorCommand::kAbort);
  EXPECT_FALSE(tick(2.02).operator_command);
  ASSERT_EQ(record_.occurrences.size(), 1U);
  EXPECT_EQ(record_.occurrences[0].kind, Kind::kStep);
  EXPECT_EQ(record_.occurrences[0].name, "now");
  EXPECT_EQ(record_.occurrences[0].t_s, 2.0);
}

TEST_F(ScriptPlayed, AStepWaitsForTheFirstEntryOfItsState) {
  play("<at state=\"in\" after=\"3\"" + kAbort);
  happens(Kind::kEvent, 1.0, "in");
  happens(Kind::kEntered, 1.0, "out");
  EXPECT_FALSE(tick(10.0).operator_command);
  happens(Kind::kEntered, 10.0, "in");
  happens(Kind::kEntered, 12.0, "in");
  EXPECT_FALSE(tick(12.98).operator_command);
  EXPECT_EQ(tick(13.0).operator_command, OperatorCommand::kAbort);
  EXPECT_FALSE(tick(15.0).operator_command);
}

TEST_F(ScriptPlayed, AStepWaitsForItsEventOrItsGoal) {
  play("<at event=\"done.state.in\"" + kAbort +
       "<at goal=\"end\"><operator command=\"skip\"/></at>");
  happens(Kind::kEntered, 1.0, "done.state.in");
  happens(Kind::kEntered, 1.0, "end");
  EXPECT_FALSE(tick(2.0).operator_command);
  happens(Kind::kEvent, 2.0, "done.state.in");
  EXPECT_EQ(tick(2.02).operator_command, OperatorCommand::kAbort);
  happens(Kind::kHeading, 3.0, "end");
  EXPECT_EQ(tick(3.02).operator_command, OperatorCommand::kSkip);
}

TEST_F(ScriptPlayed, MutedItHappensAllTheSame) {
  play("<at time=\"1\" id=\"now\"" + kAbort, Script::kDisabled);
  EXPECT_FALSE(tick(1.0).operator_command);
  EXPECT_FALSE(tick(1.02).operator_command);
  ASSERT_EQ(record_.occurrences.size(), 1U);
  EXPECT_EQ(record_.occurrences[0].name, "now");
}

TEST_F(ScriptPlayed, TopsideSendsOneCommandPerTick) {
  play(
      "<at time=\"1\"><operator command=\"pause\"/><operator command=\"resume\"/></at>"
      "<at time=\"1\"><operator command=\"abort\"/></at>");
  EXPECT_EQ(tick(1.0).operator_command, OperatorCommand::kPause);
  EXPECT_EQ(tick(1.02).operator_command, OperatorCommand::kResume);
  EXPECT_EQ(tick(1.04).operator_command, OperatorCommand::kAbort);
  EXPECT_FALSE(tick(1.06).operator_command);
}

TEST_F(ScriptPlayed, HeartbeatsComeRegularlyAndEnd) {
  play("<at time=\"0\"><heartbeat every=\"2\" for=\"5\"/></at>");
  std::vector<int> heartbeats;
  for (int t = 0; t < 10; ++t) {
    if (tick(t).operator_command == OperatorCommand::kHeartbeat) heartbeats.push_back(t);
  }
  EXPECT_EQ(heartbeats, (std::vector<int>{0, 2, 4}));
}

TEST_F(ScriptPlayed, AFaultIsOverAfterItsTime) {
  play("<at time=\"1\"><fault name=\"imu_silent\" for=\"2\"/></at>");
  EXPECT_TRUE(tick(0.98).imu);
  EXPECT_FALSE(tick(1.0).imu);
  EXPECT_FALSE(tick(2.98).imu);
  EXPECT_TRUE(tick(3.0).imu);
}

TEST_F(ScriptPlayed, LossesConcernTheirStreamAndShare) {
  play("<at time=\"0\"><loss of=\"depth\" share=\"0.25\" for=\"100\"/></at>");
  int lost = 0;
  for (int i = 0; i < 4000; ++i) {
    const StepInputs inputs = tick(0.02 * i);
    EXPECT_TRUE(inputs.imu && inputs.health && inputs.plan);
    if (!inputs.depth) ++lost;
  }
  EXPECT_NEAR(lost, 1000, 100);
  EXPECT_TRUE(tick(100.0).depth);
}

TEST_F(ScriptPlayed, TheSameSeedLosesTheSame) {
  const auto lost = [this] {
    play("<at time=\"0\"><loss of=\"all\" share=\"0.5\"/></at>");
    std::vector<bool> pattern;
    for (int i = 0; i < 200; ++i) {
      const StepInputs inputs = tick(0.02 * i);
      pattern.insert(pattern.end(), {inputs.imu.has_value(), inputs.depth.has_value(),
                                     inputs.health.has_value(), inputs.plan.has_value()});
    }
    return pattern;
  };
  const std::vector<bool> first = lost();
  EXPECT_EQ(lost(), first);
}

TEST_F(ScriptPlayed, AnObstacleIsSeenOnceWhereItIs) {
  play("<at time=\"1\"><obstacle x=\"3\" y=\"-2\" depth=\"4\" east=\"1\"/></at>");
  static_cast<void>(tick(0.5));
  EXPECT_TRUE(appearing_.empty());
  static_cast<void>(tick(1.0));
  ASSERT_EQ(appearing_.size(), 1U);
  EXPECT_EQ(appearing_[0].X_WO.p, Eigen::Vector3d(3.0, -2.0, -4.0));
  EXPECT_EQ(appearing_[0].size, Eigen::Vector3d(1.0, 0.6, 0.6));
  static_cast<void>(tick(1.02));
  EXPECT_TRUE(appearing_.empty());
}

TEST_F(ScriptPlayed, ACurrentMovesTheWater) {
  play("<at time=\"1\"><current x=\"0.3\" y=\"0\"/></at>");
  static_cast<void>(tick(1.0));
  for (int i = 0; i < 500; ++i) static_cast<void>(simulator_.step({}));
  EXPECT_GT(simulator_.truth().X_WB.p.x(), 0.5);
}

}  // namespace
}  // namespace dive::mission
