#include "mission/states/hold.h"

#include "behaviors/hold.h"
#include "mission/document/state_reader.h"

namespace dive::mission {

HoldState::HoldState(Located<double> duration_s) : duration_s_(duration_s) {}

std::unique_ptr<behaviors::Behavior> HoldState::make_behavior(
    const BehaviorSetup& /*setup*/) const {
  return std::make_unique<behaviors::Hold>(duration_s_.value);
}

void read_hold(const XmlElement& element, const StateReader& reader, StateSpec& spec) {
  spec.atomic = std::make_shared<HoldState>(reader.attributes().number(element, "duration"));
}

}  // namespace dive::mission
