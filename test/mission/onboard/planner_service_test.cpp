#include "mission/onboard/planner_service.h"

#include <limits>

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
  EXPECT_EQ(reply->plan.status, planning::PlanStatus::kSuccess);
  EXPECT_NEAR(reply->plan.length_m, 6.0, 0.05);
  EXPECT_FALSE(service.poll(from_seconds(2.0))) << "once";
}

TEST(PlannerService, ANewQueryDropsTheOldOne) {
  const planning::World world;
  PlannerService service(world, small_box(), {}, from_seconds(0.1));
  service.submit(query(1, {6, 0, -5}), 0);
  service.submit(query(2, {0, 6, -5}), 20'000);
  const std::optional<PlanReply> reply = service.poll(from_seconds(1.0));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->id, 2);
  EXPECT_NEAR(reply->plan.waypoints.back().p.y(), 6.0, 1e-9);
}

TEST(PlannerService, ReportsWhyThereIsNoPathAndPassesNoneOn) {
  const planning::World world;
  PlannerService service(world, small_box(), {}, from_seconds(0.1));
  service.submit(query(1, {6, 0, std::numeric_limits<double>::quiet_NaN()}), 0);
  const std::optional<PlanReply> reply = service.poll(from_seconds(1.0));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->plan.status, planning::PlanStatus::kInvalid);
  EXPECT_FALSE(reply->plan.reason.empty());
  EXPECT_TRUE(reply->plan.waypoints.empty());
}

// A wall 0.26 m beside the start: the path out of there goes on only to who accepts so little.
TEST(PlannerService, HandsOnAReducedPathOnlyWhereTheQueryAcceptsIt) {
  Pose wall;
  wall.p = {10.0, -1.0, -5.0};
  const planning::World world{{{"wall", planning::Box{{40.0, 1.0, 10.0}}, wall}}};
  PlannerService service(world, small_box(), {}, from_seconds(0.1));
  const auto reply_to = [&](double accepted) {
    PlanQuery question = query(1, {8, 3, -5});
    question.request.limits.reduced_clearance = accepted;
    service.submit(question, 0);
    return service.poll(from_seconds(1.0)).value_or(PlanReply{});
  };
  const PlanReply given = reply_to(0.1);
  EXPECT_EQ(given.plan.status, planning::PlanStatus::kReduced);
  EXPECT_GE(given.plan.waypoints.size(), 2U);
  EXPECT_NEAR(given.plan.clearance_m, 0.26, 0.021);
  EXPECT_FALSE(given.plan.reason.empty());
  const PlanReply kept = reply_to(std::numeric_limits<double>::infinity());
  EXPECT_EQ(kept.plan.status, planning::PlanStatus::kReduced);
  EXPECT_TRUE(kept.plan.waypoints.empty());
}

}  // namespace
}  // namespace dive::mission
