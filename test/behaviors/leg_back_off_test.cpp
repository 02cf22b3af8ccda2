// In an unknown environment: backing off, alternative paths, and observing a blocked goal.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "behaviors/goal_sequence.h"
#include "behaviors/surface.h"
#include "test/behaviors/leg_sample.h"

namespace dive::behaviors {
namespace {

LegSettings unknown_environment() {
  LegSettings result = settings();
  result.recovery.by_motion = true;
  return result;
}

// Beside a diver, with clearance ahead and astern but none to turn.
class Beside final : public PathEvaluator {
 public:
  double clearance(std::span<const Pose> waypoints) override {
    double least = 10.0;
    for (const Pose& pose : waypoints) {
      const bool is_across = std::abs(std::sin(to_rpy(pose.q).z())) > 0.5;
      const bool is_beside = pose.p.x() > 4.3 && pose.p.y() < 0.5;
      least = std::min(least, is_across && is_beside ? 0.1 : 1.2);
    }
    return least;
  }
  double clearance_to_all(std::span<const Pose> waypoints) override { return clearance(waypoints); }
};

// A planner whose paths turn under way, as planned ones do. How far east the vehicle was when it
// had turned north.
double turn_north(bool with_trail) {
  LegSettings unknown = unknown_environment();
  Leg leg(unknown, goal_at(5, 20));
  PerfectVehicle vehicle({0, 0, -3});
  Trail trail;
  Beside beside;
  vehicle.set_map(&beside, with_trail ? &trail : nullptr);
  for (; vehicle.position().x() < 5.0;
       vehicle.move_to(vehicle.position() + Eigen::Vector3d(0.1, 0, 0))) {
    trail.add(vehicle.position(), true);
  }
  BehaviorOutput output;
  while (vehicle.position().y() < 1.0 && vehicle.seconds() < 120.0) {
    std::vector<Pose> path;
    if (output.plan_request) {
      path = straight(output.plan_request->start.p, {5, 20, -3});
      path.front().q = output.plan_request->start.q;
    }
    const planning::PlanResult answer = success(path);
    output = vehicle.tick(leg, output.plan_request ? &answer : nullptr);
  }
  EXPECT_GE(vehicle.position().y(), 1.0);
  return vehicle.position().x();
}

TEST(Leg, InUnknownWaterGoesBackFromWhereItCannotTurn) { EXPECT_LT(turn_north(true), 4.3); }

TEST(Leg, InAnUnknownEnvironmentTurnsOnTheSpotIfItCannotBackOff) {
  EXPECT_NEAR(turn_north(false), 5.0, 0.2);
}

struct Narrowing {
  double least_room = 10.0;
  int turned_back = 0;
  bool unreachable = false;
  double fastest_astern = 0.0;
  double farthest = 0.0;
  std::vector<double> ways_back;  // m, each time
};

// A planner that lets the vehicle on from wherever it is, with the room that it has there.
Narrowing swim_into(ClearanceAlongX& room, bool with_trail, double seconds) {
  LegSettings unknown = unknown_environment();
  unknown.replan.map_change = true;
  unknown.replan.min_interval_s = 0.5;
  unknown.replan.max_replans = 1000;
  GoalSequence sequence(unknown, {goal_at(30, 0)});
  PerfectVehicle vehicle({0, 0, -3});
  Trail trail;
  vehicle.set_map(&room, with_trail ? &trail : nullptr);
  Narrowing result;
  BehaviorOutput output;
  std::vector<Pose> path;
  bool was_back = false;
  while (vehicle.seconds() < seconds && !result.unreachable) {
    planning::PlanResult answer;
    room.observe_from(vehicle.position().x());
    if (output.plan_request) {
      path = straight(output.plan_request->start.p, {30, 0, -3});
      answer = success(path);
      answer.clearance_m = room.clearance(path);
    }
    output = vehicle.tick(sequence, output.plan_request ? &answer : nullptr);
    const bool is_back = !sequence.needs_free_ahead();
    if (is_back && !was_back) {
      ++result.turned_back;
      result.ways_back.push_back(0.0);
    }
    if (is_back) result.ways_back.back() -= 0.02 * output.command.v;
    was_back = is_back;
    if (is_back)
      result.fastest_astern = std::max(result.fastest_astern, -output.command.v);
    else
      EXPECT_GE(output.command.v, 0.0);
    const Pose here{vehicle.position(), Eigen::Quaterniond::Identity()};
    result.least_room = std::min(result.least_room, room.clearance({&here, 1}));
    result.farthest = std::max(result.farthest, here.p.x());
    result.unreachable = output.failed == Failure::kUnreachable;
  }
  return result;
}

// Each plan is let out of its start by what that has: without going back it would end in contact.
TEST(Leg, InAnUnknownEnvironmentBacksOffFromWhereItIsTooTight) {
  ClearanceAlongX funnel([](double x) { return std::clamp(0.2 * (10.0 - x), 0.0, 1.2); });
  const Narrowing result = swim_into(funnel, true, 600.0);
  EXPECT_GT(result.least_room, 0.4) << "of a clearance of 1 m";
  EXPECT_GT(result.farthest, 6.5) << "it does try";
  EXPECT_GE(result.turned_back, 5);
  EXPECT_TRUE(result.unreachable) << "and not for ever";
  EXPECT_GT(result.fastest_astern, 0.1) << "there is no room to turn about";
}

TEST(Leg, InAnUnknownEnvironmentBacksOffFromWhereItIsTightForTooLong) {
  ClearanceAlongX tunnel([](double x) { return x < 6.0 ? 1.2 : 0.7; });
  const Narrowing result = swim_into(tunnel, true, 60.0);
  EXPECT_GE(result.turned_back, 1);
  EXPECT_LT(result.farthest, 6.0 + 2.0 + 0.5);
}

TEST(Leg, InAnUnknownEnvironmentBacksOffFartherEachTimeFromOnePlace) {
  ClearanceAlongX gate([](double x) { return x < 6.0 ? 1.2 : 0.5; });
  const Narrowing result = swim_into(gate, true, 200.0);
  ASSERT_GE(result.turned_back, 4);
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_GT(result.ways_back[i], result.ways_back[i - 1] + 0.4) << i;
  }
}

TEST(Leg, InAnUnknownEnvironmentContinuesThroughAShortNarrows) {
  ClearanceAlongX gate([](double x) { return x > 5.0 && x < 6.5 ? 0.7 : 1.2; });
  const Narrowing result = swim_into(gate, true, 40.0);
  EXPECT_EQ(result.turned_back, 0);
  EXPECT_GT(result.farthest, 10.0);
}

TEST(Leg, InAnUnknownEnvironmentContinuesWhereItCannotBackOff) {
  ClearanceAlongX narrow([](double /*x*/) { return 0.4; });  // it was put there
  EXPECT_EQ(swim_into(narrow, true, 20.0).turned_back, 0);
  ClearanceAlongX behind([](double x) { return x < 6.0 ? -0.1 : 0.4; });
  EXPECT_EQ(swim_into(behind, true, 20.0).turned_back, 0);
  ClearanceAlongX funnel([](double x) { return std::clamp(0.2 * (10.0 - x), 0.1, 1.2); });
  EXPECT_EQ(swim_into(funnel, false, 30.0).turned_back, 0);
}

// A planner that has found the straight way by the next tick.
void tick_and_plan(PerfectVehicle& vehicle, GoalSequence& sequence, BehaviorOutput& output) {
  std::vector<Pose> path;
  const bool asked = output.plan_request.has_value();
  if (asked) path = straight(output.plan_request->start.p, {30, 0, -3});
  const planning::PlanResult answer = success(path);
  output = vehicle.tick(sequence, asked ? &answer : nullptr);
}

// If it cannot observe the path it does not wait for ever, nor give up at once.
TEST(Leg, RequestsAnAlternativePathAfterBackingOffALittle) {
  LegSettings unknown = unknown_environment();
  GoalSequence sequence(unknown, {goal_at(30, 0)});
  PerfectVehicle vehicle({0, 0, -3});
  Trail trail;
  ClearanceAlongX open([](double /*x*/) { return 1.2; });
  open.observe_from(0.0);
  vehicle.set_map(&open, &trail);
  BehaviorOutput output;
  int others = 0;
  while (vehicle.seconds() < 300.0 && output.failed == Failure::kNone) {
    tick_and_plan(vehicle, sequence, output);
    open.observe_from(vehicle.position().x());
    if (vehicle.position().x() < 4.0 || !sequence.needs_free_ahead()) continue;
    if (!sequence.request_alternative()) break;
    ++others;
    output = vehicle.tick(sequence);
    EXPECT_FALSE(sequence.needs_free_ahead());
    double farthest_back = 10.0;
    while (!sequence.needs_free_ahead() && vehicle.seconds() < 300.0) {
      output = vehicle.tick(sequence);
      farthest_back = std::min(farthest_back, vehicle.position().x());
    }
    EXPECT_LT(farthest_back, 3.3);
    EXPECT_TRUE(output.plan_request) << "and replans from there";
  }
  EXPECT_EQ(others, 5) << "then it is out of reach";
}

// A diver was at the goal, and the vehicle holds with its stern to it.
TEST(Leg, InAnUnknownEnvironmentObservesAGoalThatIsOccupied) {
  LegSettings unknown = unknown_environment();
  const planning::PlanResult failure =
      testing::plan_answer(planning::PlanStatus::kNoPath, "occupied", {}, 0.0);
  for (const double room : {1.0, 0.05}) {
    Leg leg(unknown, goal_at(-6, 0));
    PerfectVehicle vehicle({0, 0, -3});
    ClearanceAlongX around([&](double /*x*/) { return room; });
    around.observe_from(0.0);
    Trail trail;
    vehicle.set_map(&around, &trail);
    BehaviorOutput output = vehicle.tick(leg);
    while (vehicle.seconds() < 5.0) {
      output = vehicle.tick(leg, output.plan_request ? &failure : nullptr);
    }
    const double yaw = std::abs(to_rpy(output.command.o).z());
    EXPECT_NEAR(yaw, room > 0.1 ? M_PI : 0.0, 1e-9) << "where there is room to turn";
  }
}

// From where the vehicle waits it cannot observe that the diver has left the goal.
TEST(Leg, InAnUnknownEnvironmentObservesABlockedGoalFromNearer) {
  LegSettings unknown = unknown_environment();
  unknown.recovery.unreachable_after = 40;
  unknown.replan.max_replans = 1000;
  for (const bool leaves : {true, false}) {
    GoalSequence sequence(unknown, {goal_at(20, 0)});
    PerfectVehicle vehicle({0, 0, -3});
    bool is_there = false;
    ClearanceAlongX water(
        [&](double x) { return is_there ? std::clamp(18.0 - x, -1.0, 1.2) : 1.2; });
    water.observe_from(30.0);
    Trail trail;
    vehicle.set_map(&water, &trail);
    std::vector<Pose> path;
    BehaviorOutput output;
    int near = 0;
    double farthest = 0.0;
    while (vehicle.seconds() < 400.0 && !output.done && output.failed == Failure::kNone) {
      planning::PlanResult answer =
          testing::plan_answer(planning::PlanStatus::kNoPath, "the goal is occupied", {}, 0.0);
      if (output.plan_request) {
        const Pose& goal = output.plan_request->goal;
        path = straight(output.plan_request->start.p, goal.p);
        if (water.clearance({&goal, 1}) >= unknown.limits.clearance) answer = success(path);
        if (goal.p.x() < 19.0) ++near;
      }
      output = vehicle.tick(sequence, output.plan_request ? &answer : nullptr);
      const double x = vehicle.position().x();
      farthest = std::max(farthest, x);
      if (x > 9.0 && x < 10.0) is_there = true;
      if (leaves && x > 15.0) is_there = false;
    }
    EXPECT_EQ(output.done, leaves);
    EXPECT_EQ(near, 1) << "nearer than that it cannot come";
    if (leaves) continue;
    EXPECT_EQ(output.failed, Failure::kUnreachable) << "near it is not there";
    EXPECT_GT(farthest, 16.0);
    EXPECT_LT(farthest, 17.1) << "and keeps its clearance";
  }
}

TEST(Leg, GoingBackFromOnePlaceIsNotGoingBackFromAnother) {
  LegSettings unknown = unknown_environment();
  GoalSequence sequence(unknown, {goal_at(30, 0)});
  PerfectVehicle vehicle({0, 0, -3});
  Trail trail;
  ClearanceAlongX open([](double /*x*/) { return 1.2; });
  open.observe_from(30.0);
  vehicle.set_map(&open, &trail);
  BehaviorOutput output;
  const auto swim_beyond = [&](double x) {
    do {
      tick_and_plan(vehicle, sequence, output);
    } while ((vehicle.position().x() < x || !sequence.needs_free_ahead()) &&
             vehicle.seconds() < 300.0);
  };
  for (const double x : {4.0, 12.0}) {
    for (int i = 0; i < 5; ++i) {
      swim_beyond(x);
      EXPECT_TRUE(sequence.request_alternative()) << x;
      output = vehicle.tick(sequence);
    }
  }
  swim_beyond(12.0);
  EXPECT_FALSE(sequence.request_alternative());
}

TEST(Leg, WithoutAPathBackThereIsNoAlternative) {
  LegSettings unknown = settings();
  EXPECT_FALSE(GoalSequence(unknown, {goal_at(30, 0)}).request_alternative()) << "on a known map";
  unknown.recovery.by_motion = true;
  GoalSequence sequence(unknown, {goal_at(30, 0)});
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(sequence.request_alternative());
  EXPECT_EQ(vehicle.tick(sequence).failed, Failure::kUnreachable);
}

// Something to drift against while it rises, at x > 5; it came from there.
TEST(Surface, InAnUnknownEnvironmentBacksOffFirst) {
  ClearanceAlongX beside([](double x) { return x > 5.0 ? 0.2 : 1.0; });
  beside.observe_from(10.0);
  Trail trail;
  PerfectVehicle vehicle({0, 0, -3});
  vehicle.set_map(&beside, &trail);
  for (double x = 0.0; x < 6.0; x += 0.1) {
    vehicle.move_to({x, 0, -3});
    trail.add(vehicle.position(), x > 4.6 || x < 3.0);
  }
  Surface surface({.clearance = 1.0});
  while (vehicle.position().z() < -2.9 && vehicle.seconds() < 60.0) vehicle.tick(surface);
  EXPECT_LT(vehicle.position().x(), 5.0);
  EXPECT_GT(vehicle.position().x(), 4.5) << "the water behind is under an overhead";
  EXPECT_LT(vehicle.seconds(), 20.0);

  vehicle.move_to({6.0, 0, -3});
  Surface crippled({.clearance = 1.0});
  BehaviorInput input = vehicle.input(nullptr);
  input.depth_known = false;
  EXPECT_LT(crippled.step(input).command.d, 0.0) << "up, and nothing else";
}

}  // namespace
}  // namespace dive::behaviors
