#pragma once
// Answers of a planner, for the tests of what behaviours do with them.

#include <span>
#include <string>
#include <utility>

#include "planning/plan.h"

namespace dive::behaviors::testing {

/// Accepted where its status has a path.
inline planning::PlanResult plan_answer(planning::PlanStatus status, std::string reason,
                                        std::span<const Pose> path, double clearance_m) {
  planning::PlanResult plan;
  plan.status = status;
  plan.accepted = planning::has_path(status);
  plan.reason = std::move(reason);
  plan.waypoints.assign(path.begin(), path.end());
  plan.clearance_m = clearance_m;
  return plan;
}

}  // namespace dive::behaviors::testing
