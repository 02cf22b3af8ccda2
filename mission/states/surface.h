#pragma once
// <surface>: straight up.

#include "mission/states/atomic_state.h"

namespace dive {
struct XmlElement;
}

namespace dive::mission {

class StateReader;

class SurfaceState final : public AtomicState {
 public:
  enum class Obstacles {
    kBackOffFirst,  ///< Moves away first from obstacles that it may drift against.
    kIgnored,       ///< Ascends at once, for emergencies.
  };
  explicit SurfaceState(Obstacles obstacles = Obstacles::kBackOffFirst);

  [[nodiscard]] End end() const override { return End::kAtTheSurface; }
  [[nodiscard]] std::unique_ptr<behaviors::Behavior> make_behavior(
      const BehaviorSetup& setup) const override;

 private:
  Obstacles obstacles_;
};

void read_surface(const XmlElement& element, const StateReader& reader, StateSpec& spec);

}  // namespace dive::mission
