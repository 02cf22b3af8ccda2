#include "mission/document/mission.h"

#include <cmath>

#include "common/assert.h"
#include "common/se3.h"

namespace dive::mission {

Eigen::Vector3d Position::in_world(double floor_z) const {
  switch (z_units) {
    case ZUnits::kDepth:
      return {x.value, y.value, -z.value};
    case ZUnits::kAltitude:
      return {x.value, y.value, floor_z + z.value};
    case ZUnits::kZ:
      return {x.value, y.value, z.value};
  }
  DIVE_DEMAND(false);
}

int replans_per_leg(const Mission& mission, const ReplanPolicy& policy) {
  constexpr int kKnown = 50;
  constexpr int kUnknown = 400;
  if (policy.max_replans) return static_cast<int>(policy.max_replans->value);
  return mission.unknown ? kUnknown : kKnown;
}

double compass_heading_deg(double degrees) {
  const double wrapped = std::fmod(degrees, 360.0);
  return wrapped < 0.0 ? wrapped + 360.0 : wrapped;
}

double heading_to_yaw(double heading_deg) { return wrap_angle(deg_to_rad(90.0 - heading_deg)); }

planning::AttitudeMode attitude_mode(std::string_view word) {
  if (word == "horizontal") return planning::AttitudeMode::kHorizontal;
  if (word == "flat") return planning::AttitudeMode::kFlat;
  return planning::AttitudeMode::kFree;
}

}  // namespace dive::mission
