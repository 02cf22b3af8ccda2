#include "planning/mapping/scan_result.h"

#include <cmath>

namespace dive::planning {

bool is_well_formed(const FreeAhead& free_ahead) { return std::isfinite(free_ahead.free_ahead_m); }

bool is_well_formed(const ObstacleAhead& obstacle) {
  return std::isfinite(obstacle.time_s) && obstacle.p_B.allFinite();
}

bool is_well_formed(const PoseCorrection& correction) {
  return correction.correction_W.norm() <= kMaxCorrection;  // false for NaN
}

}  // namespace dive::planning
