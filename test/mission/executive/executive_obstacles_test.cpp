// What the map and the scans show in the way.

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/mission/executive/executive_sample.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

TEST_F(ExecutiveTest, SomethingInThePathIsSeenAndPlannedAround) {
  tick();
  run(3.0, straight_plan());
  query_.reset();
  appears_ = {{-1, {cube_at({3, 0, -3})}}};
  const StepOutputs outputs = tick();
  ASSERT_TRUE(query_);
  EXPECT_EQ(query_->cause, "the path is blocked or has ended");
  EXPECT_LE(outputs.command.v, 0.0) << "what leads into it is not followed";
  const PlanReply through = straight_plan();  // planned before it was observed
  EXPECT_LE(run(1.5, through).command.v, 0.0) << "and not taken";
}

// Raised once for each path: not for an obstacle beside it, nor again for the same path.
TEST_F(ExecutiveTest, AnObstacleInThePathIsAnEventAndOneBesideItIsNot) {
  use("", R"(<goto id="first" x="6" y="0" z="3" z_units="DEPTH" timeout="60" on_timeout="ascend">
               <transition event="map.changed"><log message="map changed"/></transition>
               <transition event="done.state.first" target="ascend"/>
             </goto>)");
  tick();
  run(1.0, straight_plan());
  const auto events = [&] {
    return std::ranges::count(actions_, std::string("map changed"), &ActionRecord::text);
  };
  appears_ = {{-1, {cube_at({3, 5, -3})}}};
  run(1.0);
  EXPECT_EQ(events(), 0);
  appears_ = {{-2, {cube_at({4, 0.9, -3})}}};
  run(1.0);
  EXPECT_EQ(events(), 1);
  appears_ = {{-3, {cube_at({4, -0.9, -3})}}};
  run(1.0);
  EXPECT_EQ(events(), 1) << "the same path is still followed";
}

TEST_F(ExecutiveTest, StopsForAnObstacleThatAScanShowsInItsWay) {
  tick();
  EXPECT_GT(run(3.0, straight_plan()).command.v, 0.3);
  query_.reset();
  actions_.clear();
  ahead_ = planning::ObstacleAhead{now_, 0.9, {0.7, 0.0, 0.0}};
  const StepOutputs outputs = tick();
  EXPECT_LE(outputs.command.v, 0.0) << "it brakes";
  EXPECT_FALSE(outputs.plan_query) << "the map does not have it yet";
  ASSERT_EQ(actions_.size(), 1u);
  EXPECT_THAT(actions_.front().text, HasSubstr("reaches an obstacle in 0.9 s"));
  for (int i = 0; i < 55; ++i) EXPECT_LE(tick().command.v, 0.0);
  run(0.5);
  ASSERT_TRUE(query_);
  EXPECT_GT(run(3.0, straight_plan()).command.v, 0.3) << "nothing is in the way any more";
}

// Against a current it swims back to its place while it rises.
TEST_F(ExecutiveTest, WhatAScanShowsDoesNotStopAnAscent) {
  std::string text = kMission;
  text.insert(text.find("<limits"), R"(<current speed="0.08" towards_deg="90" sigma="0.01"/>)");
  use(text);
  tick();
  says_ = OperatorCommand::kAbort;
  StepOutputs outputs = tick();
  while (outputs.command.v <= 0.0 && depth_ > 0.5) outputs = tick();
  ASSERT_GT(outputs.command.v, 0.0);
  ASSERT_EQ(outputs.status.state, "dive.abort_surface");
  const double depth = outputs.command.d;
  ahead_ = planning::ObstacleAhead{now_, 0.9, {0.7, 0.0, 0.0}};
  EXPECT_EQ(tick().command.v, 0.0);
  outputs = run(0.9);
  EXPECT_EQ(outputs.command.v, 0.0);
  EXPECT_NEAR(outputs.command.d, depth - 0.92 * 0.25, 0.01);
}

TEST_F(ExecutiveTest, AnObstacleOfAnOldScanOrOfNoPlaceIsIgnored) {
  tick();
  run(1.0, straight_plan());
  ahead_ = planning::ObstacleAhead{now_ + from_seconds(100), 0.9, {0.7, 0.0, 0.0}};
  EXPECT_GT(tick().command.v, 0.3) << "of the future";
  ahead_ = planning::ObstacleAhead{now_, 0.9, {std::nan(""), 0.0, 0.0}};
  EXPECT_GT(tick().command.v, 0.3);
  const Utime seen = now_;
  ahead_ = planning::ObstacleAhead{seen, 0.9, {0.7, 0.0, 0.0}};
  EXPECT_LE(tick().command.v, 0.0);
  run(2.0);
  EXPECT_GT(run(3.0, straight_plan()).command.v, 0.3);
  ahead_ = planning::ObstacleAhead{seen, 0.9, {0.7, 0.0, 0.0}};
  EXPECT_GT(tick().command.v, 0.3) << "once is enough";
}

TEST_F(ExecutiveTest, AnUpdateOfTheFutureOrTwiceTheSameChangesNothing) {
  StepInputs inputs;
  inputs.now = from_seconds(1.0);
  inputs.obstacles = {{planning::ObstacleSource::kMapper, from_seconds(1.2), {{1, {}}}},
                      {planning::ObstacleSource::kScript, from_seconds(1.0), {{-1, {}}}},
                      {planning::ObstacleSource::kScript, from_seconds(1.0), {{-2, {}}}}};
  update_map(map_, inputs);
  EXPECT_EQ(map_.revision(), 1);
  EXPECT_EQ(inputs.observed_map.revision(), 1);
}

}  // namespace
}  // namespace dive::mission
