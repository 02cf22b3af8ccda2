#pragma once
// <retrace>: back along the trail to open water.

#include "mission/states/atomic_state.h"

namespace dive {
struct XmlElement;
}

namespace dive::mission {

class StateReader;

class RetraceState final : public AtomicState {
 public:
  [[nodiscard]] End end() const override { return End::kInOpenWater; }
  [[nodiscard]] std::unique_ptr<behaviors::Behavior> make_behavior(
      const BehaviorSetup& setup) const override;
};

void read_retrace(const XmlElement& element, const StateReader& reader, StateSpec& spec);

}  // namespace dive::mission
