#pragma once
// A leg, a vehicle that does what it is commanded, and answers of the planner, for tests.

#include <algorithm>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "behaviors/behavior.h"
#include "behaviors/leg.h"
#include "behaviors/trail.h"
#include "test/behaviors/plan_answer.h"

namespace dive::behaviors {

inline LegSettings settings() {
  LegSettings result;
  result.limits.attitude = planning::AttitudeMode::kHorizontal;
  result.limits.clearance = 1.0;
  result.limits.min_z = -10.0;
  return result;
}

inline LegGoal goal_at(double x, double y) {
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
    input.map_changed = observed_ != nullptr && map_changes_;
    return input;
  }
  void set_map(PathEvaluator* observed, Trail* trail) {
    observed_ = observed;
    trail_ = trail;
  }
  void keep_map() { map_changes_ = false; }
  void move_to(const Eigen::Vector3d& p_W) { estimate_.X_WB.p = p_W; }
  [[nodiscard]] const Eigen::Vector3d& position() const { return estimate_.X_WB.p; }
  [[nodiscard]] double seconds() const { return to_seconds(now_); }

 private:
  Utime now_ = 0;
  PathEvaluator* observed_ = nullptr;
  Trail* trail_ = nullptr;
  bool map_changes_ = true;
  estimation::StateEstimate estimate_;
};

inline std::vector<Pose> straight(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  std::vector<Pose> poses;
  const Eigen::Quaterniond q = heading_along(b - a);
  for (int i = 0; i <= 4; ++i) poses.push_back({a + (b - a) * i / 4.0, q});
  return poses;
}

inline planning::PlanResult success(const std::vector<Pose>& path) {
  return testing::plan_answer(planning::PlanStatus::kSuccess, "", path, 1.2);
}

// Clearance by the position to the east, within the observed space.
class ClearanceAlongX final : public PathEvaluator {
 public:
  explicit ClearanceAlongX(std::function<double(double)> at) : at_(std::move(at)) {}
  double clearance(std::span<const Pose> waypoints) override {
    double least = 10.0;
    for (const Pose& pose : waypoints) {
      if (pose.p.x() < observed_to_) least = std::min(least, at_(pose.p.x()));
    }
    return least;
  }
  double clearance_to_all(std::span<const Pose> waypoints) override { return clearance(waypoints); }
  void observe_from(double x) { observed_to_ = std::max(observed_to_, x + 1.0); }

 private:
  std::function<double(double)> at_;
  double observed_to_ = 0.0;
};

}  // namespace dive::behaviors
