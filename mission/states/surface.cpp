#include "mission/states/surface.h"

#include "behaviors/surface.h"

namespace dive::mission {

SurfaceState::SurfaceState(Obstacles obstacles) : obstacles_(obstacles) {}

std::unique_ptr<behaviors::Behavior> SurfaceState::make_behavior(const BehaviorSetup& setup) const {
  behaviors::SurfaceOptions options;
  if (obstacles_ == Obstacles::kBackOffFirst && setup.leg.recovery.by_motion) {
    options.clearance = setup.leg.limits.clearance;
    options.back_off = setup.leg.recovery.back_off;
  }
  return std::make_unique<behaviors::Surface>(options);
}

void read_surface(const XmlElement& /*element*/, const StateReader& /*reader*/, StateSpec& spec) {
  spec.atomic = std::make_shared<SurfaceState>();
}

}  // namespace dive::mission
