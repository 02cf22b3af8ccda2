#include "mission/executive/planner_service.h"

#include <gtest/gtest.h>

namespace dive::mission {
namespace {

planning::RobotHull small_box() {
  planning::ConvexSolid part{"body", {}};
  for (const double x : {-0.4, 0.4}) {
    for (const double y : {-0.24, 0.24}) {
      for (const double z : {-0.11, 0.11}) part.vertices.emplace_back(x, y, z);
    }
  }
  return {{part}};
}

PlanQuery query(std::int64_t id, const Eigen::Vector3d& goal) {
  PlanQuery result;
  result.id = id;
  result.request.start.p = {0, 0, -5};
  result.request.goal.p = goal;
  return result;
}

TEST(PlannerService, AnswersAtItsTimeAndNotBefore) {
  const planning::World world;
  PlannerService service(world, small_box(), {}, from_seconds(0.1));
  EXPECT_FALSE(service.poll(0));
  service.submit(query(7, {6, 0, -5}), from_seconds(1.0));
  EXPECT_FALSE(service.poll(from_seconds(1.08)));
  const std::optional<PlanReply> reply = service.poll(from_seconds(1.1));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->id, 7);
  EXPECT_EQ(reply->status, planning::PlanStatus::kSuccess);
  EXPECT_NEAR(reply->length_m, 6.0, 0.05);
  EXPECT_FALSE(service.poll(from_seconds(2.0))) << "once";
}

TEST(PlannerService, ANewQuestionDropsTheOldOne) {
  const planning::World world;
  PlannerService service(world, small_box(), {}, from_seconds(0.1));
  service.submit(query(1, {6, 0, -5}), 0);
  service.submit(query(2, {0, 6, -5}), 20'000);
  const std::optional<PlanReply> reply = service.poll(from_seconds(1.0));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->id, 2);
  EXPECT_NEAR(reply->waypoints.back().p.y(), 6.0, 1e-9);
}

TEST(PlannerService, SaysWhyThereIsNoPathAndHandsNoneOn) {
  const planning::World world;
  PlannerService service(world, small_box(), {}, from_seconds(0.1));
  service.submit(query(1, {6, 0, std::numeric_limits<double>::quiet_NaN()}), 0);
  const std::optional<PlanReply> reply = service.poll(from_seconds(1.0));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->status, planning::PlanStatus::kInvalid);
  EXPECT_FALSE(reply->reason.empty());
  EXPECT_TRUE(reply->waypoints.empty());
}

}  // namespace
}  // namespace dive::mission
