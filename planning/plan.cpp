#include "planning/plan.h"

namespace dive::planning {

const char* to_string(PlanStatus status) {
  switch (status) {
    case PlanStatus::kSuccess:
      return "success";
    case PlanStatus::kReduced:
      return "reduced";
    case PlanStatus::kNoPath:
      return "no_path";
    case PlanStatus::kInvalid:
      return "invalid";
  }
  return "invalid";
}

double path_length(std::span<const Pose> waypoints) {
  double length = 0.0;
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    length += (waypoints[i].p - waypoints[i - 1].p).norm();
  }
  return length;
}

}  // namespace dive::planning
