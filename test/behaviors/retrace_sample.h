#pragma once
// A vehicle at the inner end of a trail below an overhead, for tests of Retrace.

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "behaviors/behavior.h"
#include "behaviors/retrace.h"
#include "behaviors/trail.h"
#include "test/behaviors/plan_answer.h"

namespace dive::behaviors {

inline constexpr double kTick = 0.02;  // s

// Clearance by position; a motion has the least in its swept volume.
class FakeClearance final : public PathEvaluator {
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

inline double yaw_of(const Eigen::Quaterniond& q) { return to_rpy(q).z(); }

inline Pose pose_at(double x, double y) { return {{x, y, -4}, Eigen::Quaterniond::Identity()}; }

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
  FakeClearance evaluator_;
  const planning::PlanResult no_path_ =
      testing::plan_answer(planning::PlanStatus::kNoPath, "too tight", {}, 0.0);
};

}  // namespace dive::behaviors
