#pragma once
// <hold>: depth and heading for a given time.

#include "mission/states/atomic_state.h"

namespace dive {
struct XmlElement;
}

namespace dive::mission {

class StateReader;

class HoldState final : public AtomicState {
 public:
  explicit HoldState(Located<double> duration_s);

  [[nodiscard]] Located<double> rest_s() const override { return duration_s_; }
  [[nodiscard]] std::unique_ptr<behaviors::Behavior> make_behavior(
      const BehaviorSetup& setup) const override;

 private:
  Located<double> duration_s_;
};

void read_hold(const XmlElement& element, const StateReader& reader, StateSpec& spec);

}  // namespace dive::mission
