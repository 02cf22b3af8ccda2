#pragma once
// A mission's states as a statechart, beside the executive's own states:
//
//    dive.retreat       retrace: dive.back to open water, a minute in dive.wait, then dive.abort
//   dive.abort         abort_and_surface: dive.retrace, then dive.surface
//   dive.emergency     emergency_surface: straight up
//   dive.aborted       final
//
// Every top-level state of the mission has transitions to dive.retreat on dive.retrace_trail, to
// dive.abort on dive.abort_and_surface and to dive.emergency on dive.emergency_surface. No mission
// can name these events, so none can block them.

#include <memory>
#include <string>
#include <vector>

#include "mission/document/mission.h"
#include "mission/statechart/chart.h"

namespace dive::mission {

inline constexpr const char* kRetreatEvent = "dive.retrace_trail";
inline constexpr const char* kAbortEvent = "dive.abort_and_surface";
inline constexpr const char* kEmergencyEvent = "dive.emergency_surface";
inline constexpr const char* kRetreatState = "dive.retreat";
inline constexpr const char* kBackState = "dive.back";
inline constexpr const char* kWaitState = "dive.wait";
inline constexpr const char* kAbortState = "dive.abort";
inline constexpr const char* kRetraceState = "dive.retrace";
inline constexpr const char* kAbortSurfaceState = "dive.surface";
inline constexpr const char* kEmergencyState = "dive.emergency";
inline constexpr const char* kAbortedState = "dive.aborted";

struct Machine {
  statechart::Chart chart;
  std::vector<Guard> guards;        ///< Indexed by GuardId.
  std::vector<ActionSpec> actions;  ///< Indexed by ActionId.
  /// Indexed by StateId; null for the root and the executive's own states.
  std::vector<const StateSpec*> specs;
  /// Indexed by StateId; the behaviour of an atomic state, null where there is none.
  std::vector<std::shared_ptr<const AtomicState>> atomic;

  [[nodiscard]] bool is_own(statechart::StateId state) const {
    return specs[static_cast<std::size_t>(state)] == nullptr;
  }
};

/// `mission` must outlive the machine.
[[nodiscard]] Machine build_machine(const Mission& mission);

}  // namespace dive::mission
