#include "mission/states/retrace.h"

#include "behaviors/retrace.h"

namespace dive::mission {

std::unique_ptr<behaviors::Behavior> RetraceState::make_behavior(const BehaviorSetup& setup) const {
  return std::make_unique<behaviors::Retrace>(setup.trail, setup.leg, &setup.observed_map);
}

void read_retrace(const XmlElement& /*element*/, const StateReader& /*reader*/, StateSpec& spec) {
  spec.atomic = std::make_shared<RetraceState>();
}

}  // namespace dive::mission
