#include "behaviors/retrace.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "test/behaviors/plan_answer.h"

namespace dive::behaviors {
namespace {

constexpr double kTick = 0.02;  // s

// Clearance by position; a motion has the least in its swept volume.
class FakeJudge final : public PathEvaluator {
 public:
  double clearance(std::span<const Pose> waypoints) override {
    double least = at(waypoints.front().p);
    for (std::size_t i = 1; i < waypoints.size(); ++i) {
      const Eigen::Vector3d way = waypoints[i].p - waypoints[i - 1].p;
      const int steps = std::max(static_cast<int>(way.norm() / 0.05), 1);
      for (int k = 1; k <= steps; ++k) {
        least = std::min(least, at(waypoints[i - 1].p + way * k / steps));
      }
    }
    return least;
  }
  double clearance_to_all(std::span<const Pose> waypoints) override { return clearance(waypoints); }
  std::function<double(const Eigen::Vector3d&)> at = [](const Eigen::Vector3d&) { return 2.0; };
};

double yaw_of(const Eigen::Quaterniond& q) { return to_rpy(q).z(); }

Pose pose_at(double x, double y) { return {{x, y, -4}, Eigen::Quaterniond::Identity()}; }

// A vehicle at rest, level, at the inner end of a trail that went 4 m east in open water, and then
// 10 m on below an overhead.
class RetraceTest : public ::testing::Test {
 protected:
  RetraceTest() {
    settings_.limits.attitude = planning::AttitudeMode::kHorizontal;
    settings_.limits.clearance = 0.6;
    settings_.speed = 0.5;
    settings_.limits.min_altitude = 1.0;
    settings_.limits.min_z = -20.0;
    settings_.limits.max_z = -0.5;
    settings_.seed = 7;
    estimate_.valid = true;
    swim_in({-4, 0, -4}, {10, 0, -4});
  }

  // Drops a breadcrumb every half metre, in open water where x < 0; leaves the vehicle at the end.
  void swim_in(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) {
    const Eigen::Vector3d way = to_W - from_W;
    const int steps = static_cast<int>(std::round(way.head<2>().norm() / 0.5));
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector3d p_W = from_W + way * i / steps;
      trail_.add(p_W, p_W.x() < 0.0);
    }
    estimate_.X_WB.p = to_W;
  }
  // By what the map has shown since the dive began, and by what it shows now.
  void clearance_is(double clearance) {
    evaluator_.at = [=](const Eigen::Vector3d& /*p_W*/) { return clearance; };
  }
  void block(double from_x, double to_x) {
    evaluator_.at = [=](const Eigen::Vector3d& p_W) {
      return p_W.x() > from_x && p_W.x() < to_x ? -0.1 : 2.0;
    };
  }
  [[nodiscard]] Retrace with_map() { return {trail_, settings_, &evaluator_}; }
  [[nodiscard]] Retrace without_map() { return {trail_, settings_, nullptr}; }

  [[nodiscard]] BehaviorInput input(const planning::PlanResult* plan = nullptr) {
    BehaviorInput input;
    input.now = now_;
    input.estimate = &estimate_;
    input.plan = plan;
    input.attitude_known = attitude_known_;
    input.can_go_up = can_go_up_;
    return input;
  }
  BehaviorOutput after(double seconds, Retrace& retrace,
                       const planning::PlanResult* plan = nullptr) {
    now_ += from_seconds(seconds);
    return retrace.step(input(plan));
  }
  BehaviorOutput tick(Retrace& retrace, const planning::PlanResult* plan = nullptr) {
    return after(kTick, retrace, plan);
  }
  // With a map that has changed.
  BehaviorOutput observe(Retrace& retrace) {
    now_ += from_seconds(kTick);
    BehaviorInput observed = input();
    observed.observed = &evaluator_;
    observed.map_changed = true;
    return retrace.step(observed);
  }
  // Ticks until it asks for a plan or fails.
  BehaviorOutput wait_for_request(Retrace& retrace, double most_s = 1000.0) {
    const Utime end = now_ + from_seconds(most_s);
    BehaviorOutput output;
    while (!output.plan_request && output.failed == Failure::kNone && now_ < end) {
      output = tick(retrace);
    }
    return output;
  }
  // Answers each request with no path until it fails; how long that takes, s.
  double fail(Retrace& retrace, BehaviorOutput output, double most_s = 300.0) {
    const Utime begin = now_;
    while (output.failed == Failure::kNone && to_seconds(now_ - begin) < most_s) {
      output = tick(retrace, output.plan_request ? &no_path_ : nullptr);
    }
    EXPECT_EQ(output.failed, Failure::kExhausted);
    return to_seconds(now_ - begin);
  }
  BehaviorOutput follow_path(Retrace& retrace, const std::vector<Pose>& path) {
    const planning::PlanResult found =
        testing::plan_answer(planning::PlanStatus::kSuccess, "", path, 0.4);
    return tick(retrace, &found);
  }
  // Moves as commanded.
  void obey(const vehicle::Command& command) {
    Pose& X_WB = estimate_.X_WB;
    X_WB.q = command.o;
    X_WB.p += command.o * Eigen::Vector3d(kTick * command.v, 0, 0);
    X_WB.p.z() = -command.d;
    estimate_.v_WB_B = {command.v, 0, 0};
  }
  Eigen::Vector3d& p_W() { return estimate_.X_WB.p; }
  void turn_to(double yaw) { estimate_.X_WB.q = from_rpy(0, 0, yaw); }
  double& speed() { return estimate_.v_WB_B.x(); }

  Utime now_ = 0;
  bool attitude_known_ = true;
  bool can_go_up_ = false;
  estimation::StateEstimate estimate_;
  LegSettings settings_;
  Trail trail_;
  FakeJudge evaluator_;
  const planning::PlanResult no_path_ =
      testing::plan_answer(planning::PlanStatus::kNoPath, "too tight", {}, 0.0);
};

TEST_F(RetraceTest, WithNothingOverheadIsDoneOnceItHasStopped) {
  can_go_up_ = true;
  estimate_.v_WB_B = {0.1, 0.2, 0};
  Retrace retrace = without_map();
  BehaviorOutput output = tick(retrace);
  EXPECT_FALSE(output.done);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_EQ(output.command.d, 4.0);
  EXPECT_NEAR(yaw_of(output.command.o), std::atan2(0.2, 0.1), 1e-9) << "bow along its drift";
  estimate_.v_WB_B = {0, 0.081, 0};
  EXPECT_FALSE(tick(retrace).done);
  estimate_.v_WB_B = {0, 0.079, 0};
  output = tick(retrace);
  EXPECT_TRUE(output.done);
  EXPECT_EQ(output.failed, Failure::kNone);
  EXPECT_EQ(output.command.v, 0.0);
}

TEST_F(RetraceTest, WithNothingOverheadIsDoneAfterFourSecondsWhateverIsEstimated) {
  can_go_up_ = true;
  speed() = 0.4;
  p_W().z() = 0.1;
  Retrace retrace = without_map();
  const BehaviorOutput output = tick(retrace);
  EXPECT_FALSE(output.done);
  EXPECT_EQ(output.command.d, 0.0);
  EXPECT_FALSE(after(4.0, retrace).done);
  EXPECT_TRUE(tick(retrace).done);
}

TEST_F(RetraceTest, DoesNotMistakeTheEdgeOfAnOverheadForOpenWater) {
  p_W() = {-0.1, 0, -4};
  can_go_up_ = true;
  speed() = 0.4;
  Retrace retrace = without_map();
  EXPECT_FALSE(tick(retrace).done);
  p_W() = {0.1, 0, -4};
  can_go_up_ = false;
  speed() = 0.0;
  const BehaviorOutput output = tick(retrace);
  EXPECT_FALSE(output.done);
  EXPECT_GT(output.command.v, 0.0) << "back along the trail";
}

TEST_F(RetraceTest, StopsAsItIsThenComesLevelThenTurnsBack) {
  const Eigen::Quaterniond rolled = from_rpy(-1.0, 0.2, 0.1);
  estimate_.X_WB.q = rolled;
  speed() = 0.4;
  Retrace retrace = without_map();
  BehaviorOutput output = tick(retrace);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_LT(angle_between(output.command.o, rolled), 1e-9);
  estimate_.X_WB = {{10.1, 0, -4.1}, from_rpy(-0.5, 0.1, 0.2)};
  speed() = 0.081;
  output = tick(retrace);
  EXPECT_EQ(output.command.d, 4.0);
  EXPECT_LT(angle_between(output.command.o, rolled), 1e-9) << "as it was";

  estimate_.X_WB = {{10.2, 0, -4.2}, from_rpy(-0.5, 0.1, 0.3)};
  speed() = 0.079;
  const auto expect_comes_level = [&] {
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.2) << "where it has stopped";
    EXPECT_LT(angle_between(output.command.o, from_rpy(0, 0, 0.3)), 1e-9);
  };
  output = tick(retrace);
  expect_comes_level();
  estimate_.X_WB = {{10.2, 0, -4.3}, from_rpy(0.16, 0, 0.35)};
  output = tick(retrace);
  expect_comes_level();
  estimate_.X_WB.q = from_rpy(0, 0, 0.35);
  estimate_.omega_WB_B = {0, 0, 0.21};
  output = tick(retrace);
  expect_comes_level();

  estimate_.X_WB.q = from_rpy(0.14, 0, 0.35);
  estimate_.omega_WB_B = {0, 0, 0.19};
  output = tick(retrace);
  EXPECT_GT(output.command.v, 0.0);
  EXPECT_NEAR(std::abs(yaw_of(output.command.o)), M_PI, 0.1) << "west, where it came from";
  estimate_.X_WB.q = from_rpy(1.0, 0, M_PI);
  speed() = 0.4;
  EXPECT_GT(tick(retrace).command.v, 0.0) << "once is enough";
}

TEST_F(RetraceTest, TakesFourSecondsToStopAndFourToComeLevelAtMost) {
  estimate_.X_WB.q = from_rpy(1.0, 0, 0);
  speed() = 0.4;
  Retrace retrace = without_map();
  const auto roll = [](const BehaviorOutput& output) { return to_rpy(output.command.o).x(); };
  EXPECT_NEAR(roll(tick(retrace)), 1.0, 1e-9);
  EXPECT_NEAR(roll(after(4.0, retrace)), 1.0, 1e-9);
  EXPECT_NEAR(roll(tick(retrace)), 0.0, 1e-9);
  EXPECT_EQ(after(4.0, retrace).command.v, 0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0);
}

TEST_F(RetraceTest, FollowsTheTrailOutAndAMetreOn) {
  Retrace retrace = without_map();
  EXPECT_EQ(retrace.progress().goal, "open water");
  BehaviorOutput output = tick(retrace);
  EXPECT_NEAR(retrace.progress().distance_to_go_m, 11.5, 1e-9);
  EXPECT_EQ(retrace.progress().segment, 1);
  double fastest = 0.0;
  double farthest_off = 0.0;
  while (!output.done && to_seconds(now_) < 100.0) {
    obey(output.command);
    if (std::abs(p_W().x() - 5.0) < 0.01) p_W().y() = 0.2;
    can_go_up_ = p_W().x() < 0.0;
    output = tick(retrace);
    ASSERT_EQ(output.failed, Failure::kNone);
    ASSERT_FALSE(output.plan_request);
    EXPECT_FALSE(retrace.needs_free_ahead());
    fastest = std::max(fastest, output.command.v);
    farthest_off = std::max(farthest_off, retrace.progress().cross_track_m);
  }
  EXPECT_TRUE(output.done);
  EXPECT_NEAR(p_W().x(), -1.5, 0.1);
  EXPECT_EQ(fastest, 0.5);
  EXPECT_NEAR(farthest_off, 0.2, 0.01);
  EXPECT_LT(retrace.progress().distance_to_go_m, 0.1);
  EXPECT_EQ(retrace.progress().segment, 23);
}

// An obstacle that appeared in open water waits at the end of its way.
TEST_F(RetraceTest, EndsItsWayShortOfAnObstacleInOpenWaterIfThatIsEnough) {
  const auto length_m = [&](double obstacle_x) {
    evaluator_.at = [=](const Eigen::Vector3d& p_W) { return p_W.x() < obstacle_x ? 0.2 : 2.0; };
    Retrace retrace = with_map();
    EXPECT_FALSE(tick(retrace).plan_request);
    return retrace.progress().distance_to_go_m;
  };
  EXPECT_NEAR(length_m(-1.6), 11.5, 1e-9);
  EXPECT_NEAR(length_m(-1.3), 11.0, 1e-9) << "at the breadcrumb before";
  EXPECT_NEAR(length_m(-0.6), 10.5, 1e-9) << "at the first one in open water";
  EXPECT_NEAR(length_m(100.0), 11.5, 1e-9) << "where none is clear, the farthest";
}

TEST_F(RetraceTest, IsNotAtTheEndOfAShortPathWhileItTurns) {
  evaluator_.at = [](const Eigen::Vector3d& p_W) { return p_W.x() < -0.6 ? 0.2 : 2.0; };
  estimate_.X_WB = pose_at(-0.2, 0);
  Retrace retrace = with_map();
  for (int i = 0; i < 20; ++i) {  // carried away from it
    EXPECT_EQ(tick(retrace).failed, Failure::kNone) << i;
    EXPECT_LT(retrace.progress().distance_to_go_m, 0.8) << i;
    p_W().x() += 0.02;
  }
}

TEST_F(RetraceTest, PlansAroundWhatAScanShowsInItsWay) {
  Retrace retrace = with_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  now_ += from_seconds(kTick);
  BehaviorInput scanned = input();
  scanned.obstacle_ahead = true;
  const BehaviorOutput output = retrace.step(scanned);
  EXPECT_EQ(output.command.v, 0.0);
  ASSERT_TRUE(output.plan_request);
  EXPECT_STREQ(output.plan_cause, "the trail is blocked");
}

// There and back, side by side: what is nearer than 80 % of D_min may be linked.
TEST_F(RetraceTest, LeavesOutWhatLiesBetweenNearPartsOfTheTrail) {
  for (const double beside : {0.47, 0.49}) {
    trail_ = Trail();
    swim_in({-4, 0, -4}, {10, 0, -4});
    swim_in({10, beside, -4}, {5, beside, -4});
    Retrace retrace = without_map();
    static_cast<void>(tick(retrace));
    EXPECT_NEAR(retrace.progress().distance_to_go_m, beside < 0.48 ? 6.97 : 16.70, 1e-3);
  }
}

TEST_F(RetraceTest, WhereItArrivesItStopsAgainAndIsDoneIfNothingIsOverhead) {
  for (const bool stops : {true, false}) {
    can_go_up_ = false;
    estimate_.X_WB = pose_at(10, 0);
    speed() = 0.0;
    Retrace retrace = without_map();
    EXPECT_GT(tick(retrace).command.v, 0.0);
    estimate_.X_WB = {{-1.4, 0, -4.5}, from_rpy(0, 0, 3.0)};
    speed() = 0.4;
    can_go_up_ = true;
    EXPECT_GT(tick(retrace).command.v, 0.0) << "not there yet";
    p_W().x() = -1.6;
    EXPECT_FALSE(tick(retrace).done);
    BehaviorOutput output = after(stops ? 1.0 : 4.0, retrace);
    EXPECT_FALSE(output.done);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.5) << "where it arrived";
    EXPECT_NEAR(yaw_of(output.command.o), 3.0, 1e-9);
    if (stops) speed() = 0.0;
    output = tick(retrace);
    EXPECT_TRUE(output.done);
    EXPECT_EQ(output.failed, Failure::kNone);
  }
}

TEST_F(RetraceTest, ArrivesWhereItWasHalfAMetreFromTheEndAndComesNoNearer) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  can_go_up_ = true;
  for (const double x : {-0.98, -0.96, -1.02, -1.0}) {
    p_W().x() = x;
    EXPECT_FALSE(tick(retrace).done) << x;
  }
  EXPECT_TRUE(tick(retrace).done);
}

TEST_F(RetraceTest, WhereItArrivesBelowAnOverheadContinuesFiveTimes) {
  for (const bool is_unknown : {false, true}) {
    settings_.recovery.blocked_trail.wait_s = is_unknown ? 90.0 : 0.0;
    Retrace retrace = without_map();
    for (int arrival = 1; arrival <= 6; ++arrival) {
      estimate_.X_WB = {{3, 0, -4}, from_rpy(arrival == 1 ? 0.0 : 1.0, 0, M_PI)};
      BehaviorOutput output = tick(retrace);
      EXPECT_GT(output.command.v, 0.1) << "it need be level only once";
      EXPECT_NEAR(retrace.progress().distance_to_go_m, 4.5, 1e-9) << "by the trail";
      p_W() = {-1.6, 0, -4};
      output = tick(retrace);
      EXPECT_EQ(output.failed, arrival <= 5 ? Failure::kNone : Failure::kExhausted) << arrival;
    }
  }
}

TEST_F(RetraceTest, WithoutAttitudeItWaitsUntilItCanGoUp) {
  attitude_known_ = false;
  speed() = 0.4;
  Retrace retrace = without_map();
  BehaviorOutput output;
  for (int i = 0; i < 100; ++i) {
    output = after(10.0, retrace);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.0);
    EXPECT_EQ(output.failed, Failure::kNone);
    EXPECT_FALSE(output.done || output.plan_request);
  }
  can_go_up_ = true;
  EXPECT_TRUE(tick(retrace).done) << "moving or not";
}

TEST_F(RetraceTest, TheTimeWithoutAttitudeDoesNotCount) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  attitude_known_ = false;
  EXPECT_EQ(after(1000.0, retrace).command.v, 0.0);
  attitude_known_ = true;
  EXPECT_GT(tick(retrace).command.v, 0.0) << "it goes on";
  EXPECT_GT(after(60.0 + 4.0 * 11.5 / 0.5 - 0.1, retrace).command.v, 0.0);

  attitude_known_ = false;
  can_go_up_ = true;
  EXPECT_TRUE(tick(retrace).done) << "before the trail leads out";
}

TEST_F(RetraceTest, TheTimeToStopDoesNotCountWithoutAttitude) {
  can_go_up_ = true;
  speed() = 0.4;
  Retrace retrace = without_map();
  EXPECT_FALSE(tick(retrace).done);
  can_go_up_ = false;
  attitude_known_ = false;
  EXPECT_FALSE(after(100.0, retrace).done);
  can_go_up_ = true;
  attitude_known_ = true;
  EXPECT_FALSE(after(4.0, retrace).done);
  EXPECT_TRUE(tick(retrace).done);
}

// It must not rise or sink to where it turned back.
TEST_F(RetraceTest, WithoutAttitudeItHoldsTheDepthThatItHas) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  p_W() = {6, 0, -6};
  EXPECT_GT(tick(retrace).command.v, 0.0);
  attitude_known_ = false;
  EXPECT_EQ(tick(retrace).command.d, 6.0);
  p_W().z() = -6.1;
  EXPECT_EQ(tick(retrace).command.d, 6.0) << "and keeps it";
}

TEST_F(RetraceTest, FailsIfItsTrailHasNoOpenWater) {
  for (const bool is_empty : {true, false}) {
    trail_ = Trail();
    if (!is_empty) swim_in({1, 0, -4}, {10, 0, -4});
    Retrace retrace = without_map();
    for (int i = 0; i < 3; ++i) {
      const BehaviorOutput output = tick(retrace);
      EXPECT_EQ(output.failed, Failure::kExhausted);
      EXPECT_FALSE(output.done || output.plan_request);
      EXPECT_EQ(output.command.v, 0.0);
    }
  }
}

TEST_F(RetraceTest, FailsIfItsTrailNoLongerLeadsOutWhereItArrives) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  p_W() = {-1.6, 0, -4};
  EXPECT_EQ(tick(retrace).failed, Failure::kNone);
  trail_ = Trail();
  swim_in({1, 0, -4}, {10, 0, -4});
  EXPECT_EQ(tick(retrace).failed, Failure::kExhausted);
}

TEST_F(RetraceTest, PlansAroundABlockedTrailWithLessAndLessClearance) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  EXPECT_NEAR(retrace.progress().distance_to_go_m, 11.5, 1e-9) << "by the trail";
  std::set<std::uint64_t> seeds;
  for (const double clearance : {0.6, 0.36, 0.18, 0.06}) {
    ASSERT_TRUE(output.plan_request);
    EXPECT_STREQ(output.plan_cause, "the trail is blocked");
    const planning::PlanRequest& request = *output.plan_request;
    EXPECT_NEAR(request.limits.clearance, clearance, 1e-12);
    EXPECT_EQ(request.start.p, p_W());
    EXPECT_EQ(request.goal.p, Eigen::Vector3d(-1.5, 0, -4)) << "where the trail leads out";
    EXPECT_FALSE(request.goal_attitude_fixed);
    EXPECT_EQ(request.limits.min_altitude, 0.0);
    EXPECT_EQ(request.limits.min_z, -20.0);
    EXPECT_EQ(request.limits.max_z, -0.5);
    seeds.insert(request.seed);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.0);
    EXPECT_FALSE(tick(retrace).plan_request) << "one at a time";
    p_W().z() = -4.1;
    output = observe(retrace);
    EXPECT_FALSE(output.plan_request) << "whatever the map shows meanwhile";
    EXPECT_EQ(output.command.d, 4.0) << "it keeps its place";
    p_W().z() = -4.0;
    output = tick(retrace, &no_path_);
  }
  EXPECT_TRUE(seeds.contains(7));
  EXPECT_EQ(seeds.size(), 4U) << "another try must be able to end otherwise";
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_FALSE(output.plan_request);
  EXPECT_EQ(retrace.progress().plan_failures, 4);
  EXPECT_EQ(retrace.progress().plan_failure, "too tight");
}

TEST_F(RetraceTest, APlannerThatDoesNotAnswerInTenSecondsHasFailed) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  int failures = 0;
  for (const double clearance : {0.6, 0.36, 0.18, 0.06}) {
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(output.plan_request->limits.clearance, clearance, 1e-12);
    output = after(10.0, retrace);
    EXPECT_FALSE(output.plan_request || output.failed != Failure::kNone);
    output = tick(retrace);
    EXPECT_EQ(retrace.progress().plan_failures, ++failures);
    EXPECT_EQ(retrace.progress().plan_failure, "the planner did not answer within 10 s");
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
}

TEST_F(RetraceTest, EvaluatesTheTrailWhenTheMapHasChanged) {
  Retrace retrace = without_map();
  clearance_is(0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0) << "no map to evaluate it";
  BehaviorInput unchanged = input();
  unchanged.observed = &evaluator_;
  EXPECT_GT(retrace.step(unchanged).command.v, 0.0);
  BehaviorInput without_map = input();
  without_map.map_changed = true;
  EXPECT_GT(retrace.step(without_map).command.v, 0.0);
  clearance_is(0.001);
  EXPECT_GT(observe(retrace).command.v, 0.0) << "little clearance will do";
  p_W() = {9.7, 0, -4.3};
  EXPECT_GT(tick(retrace).command.v, 0.0);
  clearance_is(0.0);
  const BehaviorOutput output = observe(retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_STREQ(output.plan_cause, "the trail is blocked");
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_EQ(output.command.d, 4.3) << "where it is";
  EXPECT_EQ(output.plan_request->start.p, p_W());
}

TEST_F(RetraceTest, EvaluatesFifteenMetresOfTheTrailAhead) {
  trail_ = Trail();
  swim_in({-4, 0, -4}, {40, 0, -4});
  Retrace retrace = without_map();
  block(4.1, 4.9);
  BehaviorOutput output = tick(retrace);
  turn_to(M_PI);
  for (; p_W().x() > 4.0 && !output.plan_request; p_W().x() -= 0.05) output = observe(retrace);
  EXPECT_NEAR(p_W().x(), 19.5, 0.15);

  p_W().x() = 40.0;
  block(30.1, 30.9);
  Retrace past_it = without_map();
  output = tick(past_it);
  p_W().x() = 28.0;
  static_cast<void>(tick(past_it));
  for (; p_W().x() > 20.0; p_W().x() -= 0.05) {
    ASSERT_FALSE(observe(past_it).plan_request) << "that is behind it";
  }
}

TEST_F(RetraceTest, FollowsThePathThatWasPlanned) {
  block(4.1, 4.9);
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  for (const planning::PlanStatus status :
       {planning::PlanStatus::kSuccess, planning::PlanStatus::kReduced}) {
    Retrace retrace = with_map();
    ASSERT_TRUE(tick(retrace).plan_request);
    EXPECT_FALSE(retrace.needs_free_ahead());
    const planning::PlanResult found = testing::plan_answer(status, "", north, 0.4);
    const BehaviorOutput output = tick(retrace, &found);
    EXPECT_FALSE(output.plan_request);
    EXPECT_GT(output.command.v, 0.0);
    EXPECT_NEAR(yaw_of(output.command.o), 0.5 * M_PI, 0.01);
    EXPECT_TRUE(retrace.needs_free_ahead());
    EXPECT_EQ(retrace.progress().clearance_m, 0.4);
    EXPECT_NEAR(retrace.progress().distance_to_go_m, 14.0, 1e-9);
    EXPECT_EQ(retrace.progress().plan_failures, 0);
  }
}

TEST_F(RetraceTest, APathThatIsFoundEndsTheFailuresInARow) {
  block(4.1, 4.9);
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  Retrace retrace = with_map();
  ASSERT_TRUE(tick(retrace).plan_request);
  ASSERT_TRUE(tick(retrace, &no_path_).plan_request);
  EXPECT_EQ(retrace.progress().plan_failures, 1);
  const planning::PlanResult found =
      testing::plan_answer(planning::PlanStatus::kSuccess, "", north, 0.4);
  EXPECT_GT(tick(retrace, &found).command.v, 0.0);
  EXPECT_EQ(retrace.progress().plan_failures, 0);
  EXPECT_EQ(retrace.progress().plan_failure, "");
}

TEST_F(RetraceTest, AnAnswerWithoutAPathIsAFailure) {
  block(4.1, 4.9);
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  const std::span<const Pose> all = north;
  for (const planning::PlanResult& answer :
       {testing::plan_answer(planning::PlanStatus::kNoPath, "blocked", all, 0.4),
        testing::plan_answer(planning::PlanStatus::kInvalid, "blocked", all, 0.4),
        testing::plan_answer(planning::PlanStatus::kSuccess, "blocked", all.first(1), 0.4)}) {
    Retrace retrace = with_map();
    ASSERT_TRUE(tick(retrace).plan_request);
    const BehaviorOutput output = tick(retrace, &answer);
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(output.plan_request->limits.clearance, 0.36, 1e-12);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_FALSE(retrace.needs_free_ahead());
    EXPECT_EQ(retrace.progress().plan_failures, 1);
    EXPECT_EQ(retrace.progress().plan_failure, "blocked");
  }
}

TEST_F(RetraceTest, PlansIfItDoesNotGetOnInTime) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  EXPECT_GT(after(60.0 + 4.0 * 11.5 / 0.5, retrace).command.v, 0.0);
  BehaviorOutput output = tick(retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_STREQ(output.plan_cause, "the vehicle makes no progress along its trail");
  EXPECT_EQ(output.command.v, 0.0);
  p_W().z() = -4.1;
  EXPECT_EQ(tick(retrace).command.d, 4.0) << "it keeps its place";
  p_W().z() = -4.0;

  EXPECT_GT(follow_path(retrace, {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)}).command.v, 0.0);
  EXPECT_GT(after(60.0 + 4.0 * 14.0 / 0.5, retrace).command.v, 0.0);
  output = tick(retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_NEAR(output.plan_request->limits.clearance, 0.36, 1e-12);
}

TEST_F(RetraceTest, PlansForAnAlternativeToAPlannedPath) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  EXPECT_TRUE(retrace.request_alternative());
  EXPECT_GT(tick(retrace).command.v, 0.0) << "there is none to its trail";
  clearance_is(0.0);
  ASSERT_TRUE(observe(retrace).plan_request);
  EXPECT_TRUE(retrace.request_alternative());
  EXPECT_FALSE(tick(retrace).plan_request) << "it is being planned";
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  EXPECT_GT(follow_path(retrace, north).command.v, 0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0);

  EXPECT_TRUE(retrace.request_alternative());
  const BehaviorOutput output = tick(retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_STREQ(output.plan_cause, "the planned path enters space that the sensor cannot observe");
  EXPECT_NEAR(output.plan_request->limits.clearance, 0.36, 1e-12);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_TRUE(retrace.request_alternative());
  p_W().z() = -4.1;
  EXPECT_EQ(tick(retrace).command.d, 4.0) << "it keeps its place";
  p_W().z() = -4.0;
  EXPECT_GT(follow_path(retrace, north).command.v, 0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0) << "asked for once";
}

TEST_F(RetraceTest, PlansWithFullClearanceAgainOnceItHasGotOn) {
  for (const double swum : {0.49, 0.51}) {
    p_W() = {10, 0, -4};
    Retrace retrace = without_map();
    EXPECT_GT(tick(retrace).command.v, 0.0);
    clearance_is(0.0);
    ASSERT_TRUE(observe(retrace).plan_request);
    EXPECT_GT(follow_path(retrace, {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)}).command.v,
              0.0);
    p_W().y() = swum;
    clearance_is(0.001);
    EXPECT_GT(observe(retrace).command.v, 0.0);
    clearance_is(0.0);
    const BehaviorOutput output = observe(retrace);
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(output.plan_request->limits.clearance, swum < 0.5 ? 0.36 : 0.6, 1e-12);
  }
}

TEST_F(RetraceTest, MeasuresHowFarItHasGotOnFromWhereThePathBegan) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  clearance_is(0.0);
  for (const double clearance : {0.6, 0.36, 0.18}) {
    const BehaviorOutput output = observe(retrace);
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(output.plan_request->limits.clearance, clearance, 1e-12);
    const double x = p_W().x();
    EXPECT_GT(follow_path(retrace, {pose_at(x, 0), pose_at(x + 9, 0)}).command.v, 0.0);
    p_W().x() += 0.3;
  }
}

TEST_F(RetraceTest, AfterFortyPlannedPathsGettingOnNoLongerCounts) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  clearance_is(0.0);
  BehaviorOutput output = observe(retrace);
  int planned = 0;
  while (output.plan_request && planned < 100) {
    ++planned;
    const double clearance = planned <= 40 ? 1.0 : planned == 41 ? 0.6 : planned == 42 ? 0.3 : 0.1;
    EXPECT_NEAR(output.plan_request->limits.clearance, 0.6 * clearance, 1e-12) << planned;
    const double x = p_W().x();
    EXPECT_GT(follow_path(retrace, {pose_at(x, 0), pose_at(x + 1, 0), pose_at(x + 9, 0)}).command.v,
              0.0);
    p_W().x() += 0.6;
    output = observe(retrace);
  }
  EXPECT_EQ(planned, 43);
  EXPECT_EQ(output.failed, Failure::kExhausted);
}

// From the end of one short planned path to that of the next, none in open water.
TEST_F(RetraceTest, ArrivalsByPlannedPathsCountUnlessTheyLeadBackOntoTheTrail) {
  block(4.1, 4.9);
  for (const bool is_unknown : {false, true}) {
    settings_.recovery.blocked_trail.wait_s = is_unknown ? 90.0 : 0.0;
    p_W() = {8, 0, -4};
    Retrace retrace = with_map();
    int arrivals = 0;
    BehaviorOutput output = wait_for_request(retrace);
    while (arrivals < 20) {
      ASSERT_TRUE(output.plan_request);
      const double y = p_W().y();
      const double on = y < 0.5 ? 1.0 : -1.0;
      EXPECT_GT(follow_path(retrace, {pose_at(8, y), pose_at(8, y + on)}).command.v, 0.0);
      p_W().y() = y + 1.1 * on;
      output = tick(retrace);
      ++arrivals;
      if (output.failed != Failure::kNone) break;
      output = tick(retrace);
      EXPECT_FALSE(retrace.needs_free_ahead()) << "that was the trail again";
    }
    EXPECT_EQ(arrivals, is_unknown ? 20 : 6);
  }
}

// What blocks the trail may go away, and nothing but the trail is known.
class RetraceInUnknownEnvironment : public RetraceTest {
 protected:
  RetraceInUnknownEnvironment() { settings_.recovery.blocked_trail.wait_s = 90.0; }
};

TEST_F(RetraceInUnknownEnvironment, ObservesTheTrailThreeTimesBeforeItPlans) {
  trail_ = Trail();
  swim_in({-4, 0, -4}, {8, 0, -4});
  swim_in({8, 0, -4}, {8, 0.5, -4});
  block(4.1, 4.9);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  const Utime blocked_since = now_;
  while (!output.plan_request && to_seconds(now_ - blocked_since) < 60.0) {
    EXPECT_EQ(output.failed, Failure::kNone);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.0);
    if (to_seconds(now_ - blocked_since) < 17.9) {
      EXPECT_NEAR(yaw_of(output.command.o), std::atan2(-0.5, -1.0), 1e-9)
          << "to the first breadcrumb that is a metre away";
    }
    output = tick(retrace);
  }
  EXPECT_NEAR(to_seconds(now_ - blocked_since), 18.0, 0.05);
}

TEST_F(RetraceInUnknownEnvironment, KeepsItsPlaceEachTimeItObservesTheTrail) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  EXPECT_EQ(tick(retrace).command.d, 4.0);
  p_W().z() = -4.1;
  EXPECT_EQ(tick(retrace).command.d, 4.0);
  static_cast<void>(after(6.0, retrace));
  EXPECT_EQ(tick(retrace).command.d, 4.1);
}

TEST_F(RetraceInUnknownEnvironment, ContinuesWhenTheTrailIsFreeAgain) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  EXPECT_EQ(tick(retrace).command.v, 0.0);
  clearance_is(2.0);
  EXPECT_EQ(after(5.98, retrace).command.v, 0.0);
  EXPECT_EQ(tick(retrace).command.v, 0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0);
  EXPECT_FALSE(retrace.needs_free_ahead());
  EXPECT_GT(after(60.0 + 4.0 * 11.5 / 0.5 - kTick, retrace).command.v, 0.0);
  EXPECT_TRUE(tick(retrace).plan_request) << "the time on the trail counts from there";
}

TEST_F(RetraceInUnknownEnvironment, ObservesATrailWithLessThan40PercentOfTheClearance) {
  clearance_is(0.241);
  Retrace enough = with_map();
  EXPECT_GT(tick(enough).command.v, 0.0);
  EXPECT_GT(observe(enough).command.v, 0.0);
  clearance_is(0.239);
  EXPECT_EQ(observe(enough).command.v, 0.0);

  Retrace little = with_map();
  BehaviorOutput output = tick(little);
  const Utime blocked_since = now_;
  while (output.command.v == 0.0 && to_seconds(now_ - blocked_since) < 60.0) output = tick(little);
  EXPECT_NEAR(to_seconds(now_ - blocked_since), 18.0, 0.05) << "then it is swum";
  EXPECT_GT(observe(little).command.v, 0.0);
  EXPECT_FALSE(little.needs_free_ahead());
}

TEST_F(RetraceInUnknownEnvironment, APlannedPathMayHaveLittleClearance) {
  Retrace retrace = with_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  ASSERT_TRUE(after(1000.0, retrace).plan_request) << "it does not get on";
  clearance_is(0.0);
  EXPECT_FALSE(observe(retrace).plan_request);
  EXPECT_GT(follow_path(retrace, {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)}).command.v, 0.0);
  clearance_is(0.001);
  EXPECT_GT(observe(retrace).command.v, 0.0);
  clearance_is(0.0);
  const BehaviorOutput output = observe(retrace);
  EXPECT_FALSE(output.plan_request) << "it observes first";
  EXPECT_EQ(output.command.v, 0.0);
}

TEST_F(RetraceInUnknownEnvironment, ObservesAndPlansAgainUntilItsTimeIsOver) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  const Utime blocked_since = now_;
  std::vector<double> clearances;
  std::vector<double> times;
  while (output.failed == Failure::kNone && to_seconds(now_) < 200.0) {
    if (output.plan_request) {
      clearances.push_back(output.plan_request->limits.clearance);
      times.push_back(to_seconds(now_));
    }
    output = tick(retrace, output.plan_request ? &no_path_ : nullptr);
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_NEAR(to_seconds(now_ - blocked_since), 90.0, 0.15);
  EXPECT_EQ(tick(retrace).failed, Failure::kExhausted);
  ASSERT_GT(clearances.size(), 8U);
  for (std::size_t i = 4; i < clearances.size(); ++i) {
    EXPECT_EQ(clearances[i], clearances[i - 4]);
    EXPECT_NEAR(times[i] - times[i - 4], 6.0, 0.15) << "it observes between";
  }
  EXPECT_NEAR(clearances[0], 0.6, 1e-12);
  EXPECT_NEAR(clearances[3], 0.06, 1e-12);
}

TEST_F(RetraceInUnknownEnvironment, ItsTimeBeginsAgainHalfAMetreAlongAPlannedPath) {
  block(4.1, 4.9);
  for (const double swum : {0.49, 0.51}) {
    p_W() = {8, 0, -4};
    Retrace retrace = with_map();
    static_cast<void>(tick(retrace));
    const Utime blocked_since = now_;
    ASSERT_TRUE(wait_for_request(retrace).plan_request);
    EXPECT_GT(follow_path(retrace, {pose_at(8, 0), pose_at(8, 3), pose_at(2, 3)}).command.v, 0.0);
    p_W().y() = swum;
    now_ = blocked_since + from_seconds(60.0);
    const double left_s = fail(retrace, observe(retrace));
    EXPECT_NEAR(left_s, swum < 0.5 ? 30.0 : 90.0, 0.2) << swum;
  }
}

TEST_F(RetraceInUnknownEnvironment, ItsTimeBeginsAgainTwoMetresAlongTheTrail) {
  for (const double swum : {1.9, 2.1}) {
    p_W() = {8, 0, -4};
    block(4.1, 4.9);
    Retrace retrace = with_map();
    EXPECT_EQ(tick(retrace).command.v, 0.0);
    const Utime blocked_since = now_;
    clearance_is(2.0);
    static_cast<void>(after(6.0, retrace));
    EXPECT_GT(tick(retrace).command.v, 0.0);
    p_W().x() -= swum;
    now_ = blocked_since + from_seconds(40.0);
    block(4.1, 4.9);
    BehaviorOutput output = observe(retrace);
    const Utime again = now_;
    output = wait_for_request(retrace);
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(to_seconds(now_ - again), swum < 2.0 ? 12.0 : 18.0, 0.05) << "it observes";
    const double left_s = to_seconds(now_ - again) + fail(retrace, output);
    EXPECT_NEAR(left_s, swum < 2.0 ? 50.0 : 90.0, 0.2) << swum;
  }
}

TEST_F(RetraceInUnknownEnvironment, IgnoresTheAnswerToACancelledRequest) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(wait_for_request(retrace).plan_request);
  EXPECT_FALSE(wait_for_request(retrace, 11.0).plan_request) << "it observes again";
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  EXPECT_EQ(follow_path(retrace, north).command.v, 0.0);
  EXPECT_FALSE(retrace.needs_free_ahead());
  clearance_is(2.0);
  BehaviorOutput output = after(6.0, retrace);
  output = tick(retrace);
  EXPECT_GT(output.command.v, 0.0);
  output = follow_path(retrace, north);
  EXPECT_FALSE(retrace.needs_free_ahead());
  EXPECT_NEAR(std::abs(yaw_of(output.command.o)), M_PI, 0.01) << "along the trail";
  EXPECT_EQ(retrace.progress().clearance_m, 0.0);
}

// The goal of the path that is planned: off the trail as little as can be, and hardly higher.
class RetraceAim : public RetraceInUnknownEnvironment {
 protected:
  planning::PlanRequest request_from(double x) {
    p_W() = {x, 0, -4};
    Retrace retrace = with_map();
    const BehaviorOutput output = wait_for_request(retrace);
    EXPECT_TRUE(output.plan_request);
    return output.plan_request.value_or(planning::PlanRequest());
  }
};

TEST_F(RetraceAim, IsBehindWhatBlocksTheTrail) {
  block(4.1, 4.9);
  EXPECT_EQ(request_from(8.0).goal.p, Eigen::Vector3d(3.5, 0, -4));
  block(7.1, 7.4);
  EXPECT_EQ(request_from(8.0).goal.p, Eigen::Vector3d(6.5, 0, -4)) << "however near";
  block(-2.0, 4.9);
  EXPECT_EQ(request_from(8.0).goal.p, Eigen::Vector3d(-1.5, 0, -4)) << "or at its end";
  evaluator_.at = [](const Eigen::Vector3d& p_W) {
    const bool is_near = p_W.x() > 6.1 && p_W.x() < 6.9;
    const bool is_far = p_W.x() > 2.1 && p_W.x() < 2.9;
    return is_near || is_far ? 0.0 : 0.001;
  };
  EXPECT_EQ(request_from(8.0).goal.p, Eigen::Vector3d(1.5, 0, -4)) << "behind the last";
}

TEST_F(RetraceAim, IsThreeMetresOnWhereNothingBlocksTheTrail) {
  p_W() = {8, 0, -4};
  Retrace retrace = with_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  const BehaviorOutput output = after(1000.0, retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_EQ(output.plan_request->goal.p, Eigen::Vector3d(5, 0, -4));
}

TEST_F(RetraceAim, IsWithinFifteenMetresOfTheTrail) {
  trail_ = Trail();
  swim_in({-4, 0, -4}, {30, 0, -4});
  evaluator_.at = [](const Eigen::Vector3d& p_W) {
    const bool is_near = p_W.x() > 26.1 && p_W.x() < 26.9;
    const bool is_far = p_W.x() > 14.1 && p_W.x() < 14.4;
    return is_near || is_far ? 0.0 : 0.001;
  };
  EXPECT_EQ(request_from(30.0).goal.p, Eigen::Vector3d(25.5, 0, -4));
  EXPECT_EQ(request_from(29.0).goal.p, Eigen::Vector3d(13.5, 0, -4));
}

TEST_F(RetraceAim, IsAtMost30CentimetresAboveTheTrail) {
  trail_ = Trail();
  swim_in({-4, 0, -4}, {1.5, 0, -4});
  trail_.add({2, 0, -2}, false);
  swim_in({2.5, 0, -4}, {5.5, 0, -4});
  trail_.add({6, 0, -3}, false);
  swim_in({6.5, 0, -4}, {10, 0, -4});
  block(4.1, 4.9);
  EXPECT_NEAR(request_from(10.0).limits.max_z, -2.7, 1e-12) << "higher only behind the goal";
  settings_.limits.max_z = -3.2;
  EXPECT_EQ(request_from(10.0).limits.max_z, -3.2) << "the mission's limit stays";
}

TEST_F(RetraceAim, IsOpenWaterInAKnownEnvironment) {
  settings_.recovery.blocked_trail.wait_s = 0.0;
  block(4.1, 4.9);
  const planning::PlanRequest request = request_from(8.0);
  EXPECT_EQ(request.goal.p, Eigen::Vector3d(-1.5, 0, -4));
  EXPECT_EQ(request.limits.max_z, -0.5);
}

TEST_F(RetraceAim, IsOpenWaterWithoutAMap) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  const BehaviorOutput output = after(1000.0, retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_EQ(output.plan_request->goal.p, Eigen::Vector3d(-1.5, 0, -4));
  EXPECT_EQ(output.plan_request->limits.max_z, -0.5);
}

}  // namespace
}  // namespace dive::behaviors
