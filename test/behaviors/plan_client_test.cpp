#include "behaviors/plan_client.h"

#include <array>

#include <gtest/gtest.h>

#include "test/behaviors/plan_answer.h"

namespace dive::behaviors {
namespace {

using Event = PlanClient::Event;

class PlanClientTest : public ::testing::Test {
 protected:
  [[nodiscard]] Event at(double seconds, const planning::PlanResult* plan = nullptr) {
    BehaviorInput input;
    input.now = from_seconds(seconds);
    input.plan = plan;
    return client_.update(input);
  }
  [[nodiscard]] planning::PlanResult answer(planning::PlanStatus status,
                                            std::size_t waypoints) const {
    return testing::plan_answer(status, "blocked", std::span(path_).first(waypoints), 0.6);
  }

  std::array<Pose, 2> path_;
  PlanClient client_;
};

TEST_F(PlanClientTest, TakesOnePathForOneQuestion) {
  const planning::PlanResult path = answer(planning::PlanStatus::kReduced, 2);
  EXPECT_EQ(at(0.0, &path), Event::kNone) << "nothing was asked";
  client_.ask(from_seconds(1.0));
  EXPECT_TRUE(client_.is_pending());
  EXPECT_EQ(at(1.1), Event::kNone);
  EXPECT_EQ(at(1.2, &path), Event::kPath);
  EXPECT_FALSE(client_.is_pending());
  EXPECT_EQ(at(1.3, &path), Event::kNone);
}

TEST_F(PlanClientTest, FailsOnceWithTheReasonOfTheAnswer) {
  for (const auto& [status, waypoints] : {std::pair(planning::PlanStatus::kNoPath, 2),
                                          {planning::PlanStatus::kInvalid, 0},
                                          {planning::PlanStatus::kSuccess, 1}}) {
    const planning::PlanResult refusal = answer(status, static_cast<std::size_t>(waypoints));
    client_.ask(0);
    EXPECT_EQ(at(0.1, &refusal), Event::kFailed);
    EXPECT_EQ(client_.reason(), "blocked");
    EXPECT_EQ(at(0.2, &refusal), Event::kNone);
  }
}

TEST_F(PlanClientTest, FailsWithAPathThatIsNotAccepted) {
  planning::PlanResult reduced = answer(planning::PlanStatus::kReduced, 2);
  reduced.accepted = false;
  client_.ask(0);
  EXPECT_EQ(at(0.1, &reduced), Event::kFailed);
}

TEST_F(PlanClientTest, FailsOnceWithoutAnAnswerInTimeAndIgnoresALateOne) {
  client_.ask(from_seconds(5.0));
  EXPECT_EQ(at(5.0 + kPlanTimeout), Event::kNone);
  EXPECT_EQ(at(5.1 + kPlanTimeout), Event::kFailed);
  EXPECT_EQ(client_.reason(), "the planner did not answer within 10 s");
  const planning::PlanResult path = answer(planning::PlanStatus::kSuccess, 2);
  EXPECT_EQ(at(5.2 + kPlanTimeout, &path), Event::kNone);
}

TEST_F(PlanClientTest, StartsItsTimeoutAgainWithEachQuestionAndHasNoneOnceCancelled) {
  client_.ask(0);
  client_.ask(from_seconds(8.0));
  EXPECT_EQ(at(12.0), Event::kNone);
  client_.cancel();
  EXPECT_EQ(at(60.0), Event::kNone);
}

}  // namespace
}  // namespace dive::behaviors
