// What a leg does when its path is blocked, opens again, or begins with a sharp turn.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "test/behaviors/leg_sample.h"

namespace dive::behaviors {
namespace {

// A diver swims to within 0.3 m of a path that has 1.2 m, and away again; until then the planner
// knows no other. What was certified with 0.3 m is swum.
TEST(Leg, StopsBeforeWhereItsPathHasLostItsClearance) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  bool is_there = true;
  ClearanceAlongX room([&](double x) { return is_there && x > 9.0 && x < 11.0 ? 0.3 : 1.2; });
  room.observe_from(20.0);
  vehicle.set_map(&room, nullptr);
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  is_there = false;
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  is_there = true;
  const planning::PlanResult failure =
      testing::plan_answer(planning::PlanStatus::kNoPath, "blocked", {}, 0.0);
  while (vehicle.seconds() < 40.0) {
    output = vehicle.tick(leg, output.plan_request ? &failure : nullptr);
    if (vehicle.position().x() < 7.0 && vehicle.position().x() > 1.0) {
      EXPECT_GT(output.command.v, 0.3) << "far off there is no hurry";
    }
  }
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_NEAR(vehicle.position().x(), 9.0 - 1.2, 0.1);
  EXPECT_GT(leg.progress().plan_failures, 10);

  is_there = false;
  while (!output.plan_request) output = vehicle.tick(leg);
  const std::vector<Pose> on = straight(vehicle.position(), {20, 0, -3});
  const planning::PlanResult again = success(on);
  output = vehicle.tick(leg, &again);
  while (!output.done && vehicle.seconds() < 100.0) output = vehicle.tick(leg);
  EXPECT_TRUE(output.done);
}

// It was mapped from afar, and nothing new is mapped when the vehicle gets there.
TEST(Leg, StopsBeforeWhatWasMappedLongBefore) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  ClearanceAlongX room([&](double x) { return x > 9.0 && x < 11.0 ? 0.3 : 1.2; });
  vehicle.set_map(&room, nullptr);
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  const planning::PlanResult answer = success(path);
  const planning::PlanResult failure =
      testing::plan_answer(planning::PlanStatus::kNoPath, "blocked", {}, 0.0);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  room.observe_from(20.0);
  output = vehicle.tick(leg);
  vehicle.keep_map();
  while (vehicle.seconds() < 40.0) {
    output = vehicle.tick(leg, output.plan_request ? &failure : nullptr);
  }
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_GT(vehicle.position().x(), 7.0);
  EXPECT_LT(vehicle.position().x(), 9.0 - 1.0);
}

// The map has the obstacle a scan or two later.
TEST(Leg, StopsForAnObstacleInItsWayAndPlansAgainOnceTheMapMayHaveIt) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  const planning::PlanResult answer = success(path);
  EXPECT_GT(vehicle.tick(leg, &answer).command.v, 0.0);
  BehaviorInput scanned = vehicle.input(nullptr);
  scanned.obstacle_ahead = true;
  BehaviorOutput output = leg.step(scanned);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_FALSE(output.plan_request);
  EXPECT_TRUE(leg.progress().path_is_blocked);
  const double stopped_at = vehicle.seconds();
  while (!output.plan_request && vehicle.seconds() < 20.0) {
    output = vehicle.tick(leg);
    EXPECT_EQ(output.command.v, 0.0);
  }
  EXPECT_NEAR(vehicle.seconds() - stopped_at, 1.2, 0.05);
  EXPECT_GT(vehicle.tick(leg, &answer).command.v, 0.0);
  EXPECT_FALSE(leg.progress().path_is_blocked);
}

// Ticks with a bent or a straight path after a mapped object has gone: true if it plans again.
bool plans_again_when_the_map_opens(bool is_bent, bool map_change = true) {
  LegSettings with_trigger = settings();
  with_trigger.replan.map_change = map_change;
  Leg leg(with_trigger, goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  if (is_bent) path[2].p.y() = 4.0;
  const planning::PlanResult answer = success(path);
  vehicle.tick(leg, &answer);
  BehaviorInput opened = vehicle.input(nullptr);
  opened.map_opened = true;
  bool plans = leg.step(opened).plan_request.has_value();
  while (vehicle.seconds() < 6.0) plans |= vehicle.tick(leg).plan_request.has_value();
  return plans;
}

TEST(Leg, PlansAgainWhereAMappedObjectHasGoneAndAShorterPathMayExist) {
  EXPECT_TRUE(plans_again_when_the_map_opens(true));
  EXPECT_FALSE(plans_again_when_the_map_opens(false)) << "no path is shorter than a straight line";
  EXPECT_FALSE(plans_again_when_the_map_opens(true, false)) << "map_change is off";
}

// The answer to an earlier request does not know that the object has gone.
TEST(Leg, PlansAgainAfterAnAnswerThatWasRequestedBeforeTheObjectWasGone) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  BehaviorInput opened = vehicle.input(nullptr);
  opened.map_opened = true;
  EXPECT_FALSE(leg.step(opened).plan_request);
  std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  path[2].p.y() = 4.0;
  const planning::PlanResult answer = success(path);
  bool plans = vehicle.tick(leg, &answer).plan_request.has_value();
  while (vehicle.seconds() < 6.0) plans |= vehicle.tick(leg).plan_request.has_value();
  EXPECT_TRUE(plans);
}

TEST(Leg, GivesUpIfNoPlanLeadsAroundAnObstacleInItsWay) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  const std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  const planning::PlanResult answer = success(path);
  int stops = 0;
  Failure failed = Failure::kNone;
  while (failed == Failure::kNone && stops < 20) {
    while (!vehicle.tick(leg).plan_request) {
    }
    EXPECT_GT(vehicle.tick(leg, &answer).command.v, 0.0);
    BehaviorInput scanned = vehicle.input(nullptr);
    scanned.obstacle_ahead = true;
    failed = leg.step(scanned).failed;
    ++stops;
  }
  EXPECT_EQ(failed, Failure::kUnreachable);
  EXPECT_EQ(stops, 5);
  EXPECT_EQ(leg.progress().plan_failure,
            "scans show an obstacle in the way that no plan leads around");
}

// Gives the leg a path to (20, 0) and swims on it as far as x.
BehaviorOutput swim_east(Leg& leg, PerfectVehicle& vehicle, double x) {
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  while (vehicle.position().x() < x) output = vehicle.tick(leg);
  return output;
}

// In a gap the planner may find that the way round is better. The gap is swum through.
TEST(Leg, KeepsItsPathIfTheNextOneBeginsWithASharpTurn) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  ClearanceAlongX room([](double /*x*/) { return 1.2; });
  vehicle.set_map(&room, nullptr);
  BehaviorOutput output = swim_east(leg, vehicle, 4.0);
  BehaviorInput demand = vehicle.input(nullptr);
  demand.replan = true;
  ASSERT_TRUE(leg.step(demand).plan_request);
  const std::vector<Pose> around = straight(vehicle.position(), {-5, 1, -3});
  const planning::PlanResult back = success(around);
  output = vehicle.tick(leg, &back);
  EXPECT_GT(output.command.v, 0.3);
  while (!output.done && vehicle.seconds() < 100.0) output = vehicle.tick(leg);
  EXPECT_TRUE(output.done);
  EXPECT_GT(vehicle.position().x(), 19.0);
}

// The planner finds a way only back: it turns after it has stopped.
TEST(Leg, StopsBeforeASharpTurnIfItsPathIsBlocked) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  ClearanceAlongX room([](double x) { return x > 9.0 ? 0.2 : 1.2; });
  vehicle.set_map(&room, nullptr);
  BehaviorOutput output = swim_east(leg, vehicle, 4.0);
  room.observe_from(20.0);
  for (int i = 0; i < 100 && !output.plan_request; ++i) output = vehicle.tick(leg);
  ASSERT_TRUE(output.plan_request);
  const std::vector<Pose> around = straight(vehicle.position(), {-5, 1, -3});
  const planning::PlanResult back = success(around);
  output = vehicle.tick(leg, &back);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_TRUE(output.brakes);
}

// A slot of the known map: on its side the vehicle has 0.5 m to its walls, level it has `level_m`.
class Slot final : public PathEvaluator {
 public:
  explicit Slot(double level_m) : level_m_(level_m) {}
  double clearance(std::span<const Pose> /*waypoints*/) override { return 10.0; }
  double clearance_to_all(std::span<const Pose> waypoints) override {
    const auto is_level = [](const Pose& pose) { return std::abs(to_rpy(pose.q).x()) < 0.1; };
    return std::ranges::any_of(waypoints, is_level) ? level_m_ : 0.5;
  }

 private:
  double level_m_;
};

// The roll in which it stops for an obstacle ahead while it swims on its side.
double roll_at_stop(PathEvaluator* room) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  vehicle.set_map(room, nullptr);
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  for (Pose& pose : path) pose.q = from_rpy(1.2, 0.0, 0.0);
  const planning::PlanResult answer = success(path);
  vehicle.tick(leg, &answer);
  for (int i = 0; i < 100; ++i) vehicle.tick(leg);
  BehaviorInput scanned = vehicle.input(nullptr);
  EXPECT_NEAR(to_rpy(scanned.estimate->X_WB.q).x(), 1.2, 0.1);
  scanned.obstacle_ahead = true;
  return to_rpy(leg.step(scanned).command.o).x();
}

// A vehicle on its side cannot hold its place; come level it might hit what it passes so.
TEST(Leg, StopsLevelWhereThereIsRoomAndElseOnItsSideIfItSwamSo) {
  Slot wide(0.41);
  EXPECT_NEAR(roll_at_stop(&wide), 0.0, 1e-9) << "0.4 of D_min: room enough to turn";
  Slot narrow(0.39);
  EXPECT_NEAR(roll_at_stop(&narrow), 1.2, 0.1);
  EXPECT_NEAR(roll_at_stop(nullptr), 1.2, 0.1) << "without a map of the surroundings";
}

// A wall at x = 6 m that the estimate places so once it has been observed: one that the map has, or
// lacks.
class Wall final : public PathEvaluator {
 public:
  explicit Wall(bool is_mapped) : is_mapped_(is_mapped) {}
  double clearance(std::span<const Pose> waypoints) override {
    return is_mapped_ ? 10.0 : clearance_to_all(waypoints);
  }
  double clearance_to_all(std::span<const Pose> waypoints) override {
    double least = 10.0;
    for (const Pose& pose : waypoints) least = std::min(least, std::max(6.0 - pose.p.x(), 0.0));
    return is_observed_ ? least : 10.0;
  }
  void observe() { is_observed_ = true; }

 private:
  bool is_mapped_;
  bool is_observed_ = false;
};

// Where the vehicle is when it asks for a path after `event`, at x = 5.9 m, where the wall was
// observed.
double asks_at(bool is_mapped, bool with_trail, bool BehaviorInput::*event) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  Wall wall(is_mapped);
  Trail trail;
  vehicle.set_map(&wall, with_trail ? &trail : nullptr);
  BehaviorOutput output = swim_east(leg, vehicle, 5.9);
  wall.observe();
  BehaviorInput input = vehicle.input(nullptr);
  input.*event = true;
  output = leg.step(input);
  while (!output.plan_request && vehicle.seconds() < 100.0) output = vehicle.tick(leg);
  EXPECT_TRUE(output.plan_request);
  return vehicle.position().x();
}

// Beside what the map lacks it has no room to turn onto another path.
TEST(Leg, OnAKnownMapBacksOffFromAnObstacleThatTheMapLacks) {
  constexpr auto kReplan = &BehaviorInput::replan;
  // 0.2 m before the breadcrumb that has 0.85 of a clearance of 1 m.
  EXPECT_LT(asks_at(false, true, kReplan), 6.0 - 0.85 + 0.25);
  EXPECT_NEAR(asks_at(false, false, kReplan), 5.9, 0.1) << "no trail";
  EXPECT_NEAR(asks_at(true, true, kReplan), 5.9, 0.1) << "an error of the position looks the same";
}

// The map has it a scan or two after the stop.
TEST(Leg, OnAKnownMapBacksOffFromAnObstacleThatItHasStoppedFor) {
  EXPECT_LT(asks_at(true, true, &BehaviorInput::obstacle_ahead), 6.0 - 0.85 + 0.25);
}

// How far east it has come after ten seconds. A pole beside the path is observed when the vehicle
// has come to x = 5 m; the clearance is `least` there, and more by `growth` per metre beyond.
double comes_past(double least, double growth, bool is_unknown = false) {
  LegSettings given = settings();
  given.recovery.by_motion = is_unknown;
  Leg leg(given, goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  Trail trail;
  ClearanceAlongX room(
      [=](double x) { return x < 4.0 ? 1.2 : least + growth * std::max(x - 5.0, 0.0); });
  vehicle.set_map(&room, &trail);
  BehaviorOutput output = swim_east(leg, vehicle, 5.0);
  room.observe_from(20.0);
  const double until_s = vehicle.seconds() + 10.0;
  while (vehicle.seconds() < until_s) output = vehicle.tick(leg);
  return vehicle.position().x();
}

TEST(Leg, OnAKnownMapSwimsOnWhereItsPathLeadsAwayFromAnObstacle) {
  EXPECT_GT(comes_past(0.5, 0.2), 8.0);
  EXPECT_LT(comes_past(0.5, 0.0), 5.1) << "along it";
  EXPECT_LT(comes_past(0.5, -0.2), 5.1) << "towards it";
  EXPECT_LT(comes_past(0.5, 0.2, true), 5.1) << "more of it may be observed ahead";
}

TEST(Leg, SwimsWhereThereWasNeverMoreClearance) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  ClearanceAlongX room([](double x) { return x > 9.0 && x < 11.0 ? 0.3 : 1.2; });
  room.observe_from(20.0);
  vehicle.set_map(&room, nullptr);
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  planning::PlanResult answer = success(path);
  answer.clearance_m = 0.3;
  BehaviorOutput output = vehicle.tick(leg, &answer);
  while (!output.done && vehicle.seconds() < 100.0) output = vehicle.tick(leg);
  EXPECT_TRUE(output.done);
}

}  // namespace
}  // namespace dive::behaviors
