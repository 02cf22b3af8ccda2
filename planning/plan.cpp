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

}  // namespace dive::planning
