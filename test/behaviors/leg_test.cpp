#include "behaviors/leg.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "behaviors/goal_sequence.h"
#include "behaviors/surface.h"
#include "behaviors/trail.h"
#include "test/behaviors/plan_answer.h"

namespace dive::behaviors {
namespace {

LegSettings settings() {
  LegSettings result;
  result.limits.attitude = planning::AttitudeMode::kHorizontal;
  result.limits.clearance = 1.0;
  result.limits.min_z = -10.0;
  return result;
}

LegGoal goal_at(double x, double y) {
  LegGoal goal;
  goal.id = "goal";
  goal.position_W = {x, y, -3};
  return goal;
}

// A vehicle that is always where it is commanded to be: moves along its commanded heading.
class PerfectVehicle {
 public:
  explicit PerfectVehicle(const Eigen::Vector3d& p_W) {
    estimate_.valid = true;
    estimate_.X_WB.p = p_W;
  }
  template <class B>
  BehaviorOutput tick(B& behavior, const planning::PlanResult* plan = nullptr) {
    now_ += 20'000;
    if (trail_ != nullptr) trail_->add(estimate_.X_WB.p, true);
    const BehaviorOutput output = behavior.step(input(plan));
    estimate_.X_WB.q = output.command.o;
    estimate_.X_WB.p += output.command.o * Eigen::Vector3d(0.02 * output.command.v, 0, 0);
    estimate_.X_WB.p.z() = -output.command.d;
    estimate_.v_WB_B = {output.command.v, 0, 0};
    return output;
  }
  [[nodiscard]] BehaviorInput input(const planning::PlanResult* plan) const {
    BehaviorInput input;
    input.now = now_;
    input.estimate = &estimate_;
    input.plan = plan;
    input.trail = trail_;
    input.observed = observed_;
    input.map_changed = observed_ != nullptr;
    return input;
  }
  void set_map(PathEvaluator* observed, Trail* trail) {
    observed_ = observed;
    trail_ = trail;
  }
  void move_to(const Eigen::Vector3d& p_W) { estimate_.X_WB.p = p_W; }
  [[nodiscard]] const Eigen::Vector3d& position() const { return estimate_.X_WB.p; }
  [[nodiscard]] double seconds() const { return to_seconds(now_); }

 private:
  Utime now_ = 0;
  PathEvaluator* observed_ = nullptr;
  Trail* trail_ = nullptr;
  estimation::StateEstimate estimate_;
};

std::vector<Pose> straight(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  std::vector<Pose> poses;
  const Eigen::Quaterniond q = heading_along(b - a);
  for (int i = 0; i <= 4; ++i) poses.push_back({a + (b - a) * i / 4.0, q});
  return poses;
}

planning::PlanResult success(const std::vector<Pose>& path) {
  return testing::plan_answer(planning::PlanStatus::kSuccess, "", path, 1.2);
}

TEST(Leg, AsksOnceWaitsThenFollowsToTheGoal) {
  Leg leg(settings(), goal_at(6, 0));
  PerfectVehicle vehicle({0, 0, -3});
  const BehaviorOutput first = vehicle.tick(leg);
  ASSERT_TRUE(first.plan_request);
  EXPECT_EQ(first.plan_request->limits.clearance, 1.0);
  EXPECT_EQ(first.plan_request->limits.min_z, -10.0);
  EXPECT_TRUE(first.plan_request->previous.empty());
  EXPECT_EQ(first.command.v, 0.0) << "no path, no way";
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(vehicle.tick(leg).plan_request);

  const std::vector<Pose> path = straight({0, 0, -3}, {6, 0, -3});
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  EXPECT_EQ(leg.progress().clearance_m, 1.2);
  for (int i = 0; i < 2000 && !output.done; ++i) output = vehicle.tick(leg);
  EXPECT_TRUE(output.done);
  EXPECT_LT((vehicle.position() - Eigen::Vector3d(6, 0, -3)).norm(), 0.5);
}

// Under water a vehicle that has drifted too near to something must get away from it.
TEST(Leg, AcceptsAndFollowsAReducedPath) {
  Leg leg(settings(), goal_at(6, 0));
  PerfectVehicle vehicle({0, 0, -3});
  const BehaviorOutput first = vehicle.tick(leg);
  ASSERT_TRUE(first.plan_request);
  EXPECT_EQ(first.plan_request->limits.reduced_clearance, 0.0);
  const std::vector<Pose> path = straight({0, 0, -3}, {6, 0, -3});
  const planning::PlanResult answer =
      testing::plan_answer(planning::PlanStatus::kReduced, "the start is near", path, 0.3);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  for (int i = 0; i < 100; ++i) output = vehicle.tick(leg);
  EXPECT_GT(output.command.v, 0.0);
  EXPECT_GT(vehicle.position().x(), 0.1);
  EXPECT_EQ(leg.progress().clearance_m, 0.3);
  EXPECT_EQ(leg.progress().plan_failures, 0);
}

TEST(Leg, DwellsAtTheGoal) {
  LegGoal goal = goal_at(3, 0);
  goal.dwell_s = 5.0;
  Leg leg(settings(), goal);
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {3, 0, -3});
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  double arrived = 0;
  for (int i = 0; i < 3000 && !output.done; ++i) {
    output = vehicle.tick(leg);
    if (arrived == 0 && output.command.v == 0.0) arrived = vehicle.seconds();
  }
  EXPECT_NEAR(vehicle.seconds() - arrived, 5.0, 0.05);
}

// A replan that was under way when the vehicle arrived must not change what it does at the goal.
TEST(Leg, AtTheGoalIgnoresAnAnswerThatComesLate) {
  for (const bool has_path : {true, false}) {
    LegSettings with_period = settings();
    with_period.replan.period_s = 2.0;
    LegGoal goal = goal_at(1.2, 0);
    goal.dwell_s = 5.0;
    Leg leg(with_period, goal);
    PerfectVehicle vehicle({0, 0, -3});
    EXPECT_TRUE(vehicle.tick(leg).plan_request);
    const std::vector<Pose> path = straight({0, 0, -3}, {1.2, 0, -3});
    planning::PlanResult answer = success(path);
    BehaviorOutput output = vehicle.tick(leg, &answer);
    bool has_asked = false;
    while (leg.progress().distance_to_go_m > 0.0 && vehicle.seconds() < 60.0) {
      output = vehicle.tick(leg);
      has_asked |= output.plan_request.has_value();
    }
    ASSERT_TRUE(has_asked);
    const std::vector<Pose> north = straight(vehicle.position(), {1.2, 9, -7});
    answer = has_path ? success(north)
                      : testing::plan_answer(planning::PlanStatus::kNoPath, "late", {}, 0.0);
    output = vehicle.tick(leg, &answer);
    EXPECT_FALSE(output.done || output.plan_request);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 3.0);
    EXPECT_NEAR(to_rpy(output.command.o).z(), 0.0, 1e-9);
    EXPECT_EQ(leg.progress().plan_failures, 0);
  }
}

TEST(Leg, KeepsTheOldPathWhileAndAfterAReplanFails) {
  LegSettings with_period = settings();
  with_period.replan.period_s = 3.0;
  Leg leg(with_period, goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  while (!output.plan_request && vehicle.seconds() < 10) output = vehicle.tick(leg);
  ASSERT_TRUE(output.plan_request);
  EXPECT_FALSE(output.plan_request->previous.empty()) << "warm-started from the path it has";
  EXPECT_LT((output.plan_request->previous.back().p - path.back().p).norm(), 1e-12);
  EXPECT_GT(output.command.v, 0.1);
  const planning::PlanResult failure =
      testing::plan_answer(planning::PlanStatus::kNoPath, "blocked", {}, 0.0);
  output = vehicle.tick(leg, &failure);
  EXPECT_GT(output.command.v, 0.1);
  EXPECT_EQ(leg.progress().plan_failures, 1);
  EXPECT_EQ(leg.progress().plan_failure, "blocked");
}

TEST(Leg, APlannerThatDoesNotAnswerHasFailed) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  Failure failed = Failure::kNone;
  while (failed == Failure::kNone && vehicle.seconds() < 60) failed = vehicle.tick(leg).failed;
  EXPECT_EQ(failed, Failure::kUnreachable);
  EXPECT_NEAR(vehicle.seconds(), 21.0, 0.2) << "twice ten seconds, and one between";
  EXPECT_EQ(leg.progress().plan_failure, "the planner did not answer within 10 s");
}

TEST(Leg, RetriesAFailedFirstPlanThenGivesUp) {
  LegSettings few = settings();
  few.replan.max_replans = 4;
  Leg leg(few, goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  const planning::PlanResult failure =
      testing::plan_answer(planning::PlanStatus::kNoPath, "blocked", {}, 0.0);
  int asked = 0;
  std::vector<std::uint64_t> seeds;
  BehaviorOutput output;
  int unreachable = 0;
  while (output.failed != Failure::kExhausted && vehicle.seconds() < 60) {
    const bool answer = output.plan_request.has_value();
    output = vehicle.tick(leg, answer ? &failure : nullptr);
    EXPECT_EQ(output.command.v, 0.0);
    if (output.failed == Failure::kUnreachable) {
      ++unreachable;
      EXPECT_EQ(leg.progress().plan_failures, 2);
    }
    if (output.plan_request) {
      ++asked;
      seeds.push_back(output.plan_request->seed);
    }
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_EQ(unreachable, 1) << "reported once, and still tried again";
  EXPECT_EQ(asked, 5) << "the first and four more";
  EXPECT_EQ(leg.progress().plan_failures, 5);
  EXPECT_NE(seeds[0], seeds[1]) << "another try must be able to end otherwise";
  EXPECT_GE(vehicle.seconds(), 4.0) << "one second between tries";
}

TEST(Leg, PlansAgainWhenItMissedTheGoal) {
  Leg leg(settings(), goal_at(4, 0));
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {4, 0, -3});
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  vehicle.move_to({4.5, 2.0, -3});  // swept past it, abeam
  for (int i = 0; i < 50 && !output.plan_request; ++i) output = vehicle.tick(leg);
  ASSERT_TRUE(output.plan_request);
  EXPECT_FALSE(output.done);
}

// Clearance by the position to the east, within the observed space.
class Room final : public PathEvaluator {
 public:
  explicit Room(std::function<double(double)> at) : at_(std::move(at)) {}
  double clearance(std::span<const Pose> waypoints) override {
    double least = 10.0;
    for (const Pose& pose : waypoints) {
      if (pose.p.x() < seen_to_) least = std::min(least, at_(pose.p.x()));
    }
    return least;
  }
  double clearance_to_all(std::span<const Pose> waypoints) override { return clearance(waypoints); }
  void look_from(double x) { seen_to_ = std::max(seen_to_, x + 1.0); }

 private:
  std::function<double(double)> at_;
  double seen_to_ = 0.0;
};

// A diver swims to within 0.3 m of a path that has 1.2 m, and away again; until then the planner
// knows no other. What was certified with 0.3 m is swum.
TEST(Leg, StopsBeforeWhereItsPathHasLostItsClearance) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  bool is_there = true;
  Room room([&](double x) { return is_there && x > 9.0 && x < 11.0 ? 0.3 : 1.2; });
  room.look_from(20.0);
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
  Room room([](double /*x*/) { return 1.2; });
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
  Room room([](double x) { return x > 9.0 ? 0.2 : 1.2; });
  vehicle.set_map(&room, nullptr);
  BehaviorOutput output = swim_east(leg, vehicle, 4.0);
  room.look_from(20.0);
  for (int i = 0; i < 100 && !output.plan_request; ++i) output = vehicle.tick(leg);
  ASSERT_TRUE(output.plan_request);
  const std::vector<Pose> around = straight(vehicle.position(), {-5, 1, -3});
  const planning::PlanResult back = success(around);
  output = vehicle.tick(leg, &back);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_TRUE(output.brakes);
}

// Come level it would hit what it passes on its side.
TEST(Leg, StopsOnItsSideIfItSwamSo) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  for (Pose& pose : path) pose.q = from_rpy(1.2, 0.0, 0.0);
  const planning::PlanResult answer = success(path);
  vehicle.tick(leg, &answer);
  for (int i = 0; i < 100; ++i) vehicle.tick(leg);
  BehaviorInput scanned = vehicle.input(nullptr);
  scanned.obstacle_ahead = true;
  EXPECT_NEAR(to_rpy(leg.step(scanned).command.o).x(), 1.2, 0.1);
}

TEST(Leg, SwimsWhereThereWasNeverMoreClearance) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  Room room([](double x) { return x > 9.0 && x < 11.0 ? 0.3 : 1.2; });
  room.look_from(20.0);
  vehicle.set_map(&room, nullptr);
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  planning::PlanResult answer = success(path);
  answer.clearance_m = 0.3;
  BehaviorOutput output = vehicle.tick(leg, &answer);
  while (!output.done && vehicle.seconds() < 100.0) output = vehicle.tick(leg);
  EXPECT_TRUE(output.done);
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
  LegSettings unknown = settings();
  unknown.recovery.by_motion = true;
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
Narrowing swim_into(Room& room, bool with_trail, double seconds) {
  LegSettings unknown = settings();
  unknown.recovery.by_motion = true;
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
    room.look_from(vehicle.position().x());
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
  Room funnel([](double x) { return std::clamp(0.2 * (10.0 - x), 0.0, 1.2); });
  const Narrowing result = swim_into(funnel, true, 600.0);
  EXPECT_GT(result.least_room, 0.4) << "of a clearance of 1 m";
  EXPECT_GT(result.farthest, 6.5) << "it does try";
  EXPECT_GE(result.turned_back, 5);
  EXPECT_TRUE(result.unreachable) << "and not for ever";
  EXPECT_GT(result.fastest_astern, 0.1) << "there is no room to turn about";
}

TEST(Leg, InAnUnknownEnvironmentBacksOffFromWhereItIsTightForTooLong) {
  Room tunnel([](double x) { return x < 6.0 ? 1.2 : 0.7; });
  const Narrowing result = swim_into(tunnel, true, 60.0);
  EXPECT_GE(result.turned_back, 1);
  EXPECT_LT(result.farthest, 6.0 + 2.0 + 0.5);
}

TEST(Leg, InAnUnknownEnvironmentBacksOffFartherEachTimeFromOnePlace) {
  Room gate([](double x) { return x < 6.0 ? 1.2 : 0.5; });
  const Narrowing result = swim_into(gate, true, 200.0);
  ASSERT_GE(result.turned_back, 4);
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_GT(result.ways_back[i], result.ways_back[i - 1] + 0.4) << i;
  }
}

TEST(Leg, InAnUnknownEnvironmentContinuesThroughAShortNarrows) {
  Room gate([](double x) { return x > 5.0 && x < 6.5 ? 0.7 : 1.2; });
  const Narrowing result = swim_into(gate, true, 40.0);
  EXPECT_EQ(result.turned_back, 0);
  EXPECT_GT(result.farthest, 10.0);
}

TEST(Leg, InAnUnknownEnvironmentContinuesWhereItCannotBackOff) {
  Room narrow([](double /*x*/) { return 0.4; });  // it was put there
  EXPECT_EQ(swim_into(narrow, true, 20.0).turned_back, 0);
  Room behind([](double x) { return x < 6.0 ? -0.1 : 0.4; });
  EXPECT_EQ(swim_into(behind, true, 20.0).turned_back, 0);
  Room funnel([](double x) { return std::clamp(0.2 * (10.0 - x), 0.1, 1.2); });
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
  LegSettings unknown = settings();
  unknown.recovery.by_motion = true;
  GoalSequence sequence(unknown, {goal_at(30, 0)});
  PerfectVehicle vehicle({0, 0, -3});
  Trail trail;
  Room open([](double /*x*/) { return 1.2; });
  open.look_from(0.0);
  vehicle.set_map(&open, &trail);
  BehaviorOutput output;
  int others = 0;
  while (vehicle.seconds() < 300.0 && output.failed == Failure::kNone) {
    tick_and_plan(vehicle, sequence, output);
    open.look_from(vehicle.position().x());
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
  LegSettings unknown = settings();
  unknown.recovery.by_motion = true;
  const planning::PlanResult failure =
      testing::plan_answer(planning::PlanStatus::kNoPath, "occupied", {}, 0.0);
  for (const double room : {1.0, 0.05}) {
    Leg leg(unknown, goal_at(-6, 0));
    PerfectVehicle vehicle({0, 0, -3});
    Room around([&](double /*x*/) { return room; });
    around.look_from(0.0);
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
  LegSettings unknown = settings();
  unknown.recovery.by_motion = true;
  unknown.recovery.unreachable_after = 40;
  unknown.replan.max_replans = 1000;
  for (const bool leaves : {true, false}) {
    GoalSequence sequence(unknown, {goal_at(20, 0)});
    PerfectVehicle vehicle({0, 0, -3});
    bool is_there = false;
    Room water([&](double x) { return is_there ? std::clamp(18.0 - x, -1.0, 1.2) : 1.2; });
    water.look_from(30.0);
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
  LegSettings unknown = settings();
  unknown.recovery.by_motion = true;
  GoalSequence sequence(unknown, {goal_at(30, 0)});
  PerfectVehicle vehicle({0, 0, -3});
  Trail trail;
  Room open([](double /*x*/) { return 1.2; });
  open.look_from(30.0);
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
  Room beside([](double x) { return x > 5.0 ? 0.2 : 1.0; });
  beside.look_from(10.0);
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

TEST(GoalSequence, TakesItsGoalsInOrder) {
  GoalSequence sequence(settings(), {goal_at(3, 0), goal_at(3, 3)});
  PerfectVehicle vehicle({0, 0, -3});
  std::vector<Eigen::Vector3d> asked;
  std::vector<Pose> path;
  planning::PlanResult answer;
  BehaviorOutput output;
  for (int i = 0; i < 4000 && !output.done; ++i) {
    const bool answered = output.plan_request.has_value();
    if (answered) {
      asked.push_back(output.plan_request->goal.p);
      path = straight(output.plan_request->start.p, output.plan_request->goal.p);
      answer = success(path);
    }
    output = vehicle.tick(sequence, answered ? &answer : nullptr);
  }
  EXPECT_TRUE(output.done);
  ASSERT_GE(asked.size(), 2U);
  EXPECT_EQ(asked.front(), Eigen::Vector3d(3, 0, -3));
  EXPECT_EQ(asked.back(), Eigen::Vector3d(3, 3, -3));
  EXPECT_LT((vehicle.position() - Eigen::Vector3d(3, 3, -3)).norm(), 0.5);
}

}  // namespace
}  // namespace dive::behaviors
