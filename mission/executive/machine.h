#pragma once
// A mission's states as a statechart, beside the executive's own states:
//
//   dive.retrace       retrace: dive.retrace_path to open water, a minute in dive.retrace_wait,
//                      then dive.abort
//   dive.abort         abort_and_surface: dive.abort_retrace, then dive.abort_surface
//   dive.emergency     emergency_surface: straight up
//   dive.aborted       final
//
// Every state of the mission has, before its own transitions, those to dive.retrace on
// dive.retrace, to dive.abort on dive.abort_and_surface and to dive.emergency on
// dive.emergency_surface: no mission can block them, not even by "*" in an inner state.

#include <memory>
#include <string>
#include <vector>

#include "mission/document/mission.h"
#include "mission/statechart/chart.h"

namespace dive::mission {

inline constexpr const char* kRetraceEvent = "dive.retrace";
inline constexpr const char* kAbortEvent = "dive.abort_and_surface";
inline constexpr const char* kEmergencyEvent = "dive.emergency_surface";
inline constexpr const char* kRetraceState = "dive.retrace";
inline constexpr const char* kRetracePathState = "dive.retrace_path";
inline constexpr const char* kRetraceWaitState = "dive.retrace_wait";
inline constexpr const char* kAbortState = "dive.abort";
inline constexpr const char* kAbortRetraceState = "dive.abort_retrace";
inline constexpr const char* kAbortSurfaceState = "dive.abort_surface";
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
