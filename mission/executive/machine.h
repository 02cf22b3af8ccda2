#pragma once
// A mission's states as a statechart, with the executive's own states beside them:
//
//   dive.abort         abort_and_surface: dive.retrace, then dive.surface
//   dive.emergency     emergency_surface: straight up
//   dive.aborted       final
//
// Every top-level state of the mission goes to dive.abort on dive.abort_and_surface and to
// dive.emergency on dive.emergency_surface; no mission can name these events, so none can keep them
// from happening.

#include <string>
#include <vector>

#include "mission/document/mission.h"
#include "mission/statechart/chart.h"

namespace dive::mission {

inline constexpr const char* kAbortEvent = "dive.abort_and_surface";
inline constexpr const char* kEmergencyEvent = "dive.emergency_surface";
inline constexpr const char* kAbortState = "dive.abort";
inline constexpr const char* kRetraceState = "dive.retrace";
inline constexpr const char* kAbortSurfaceState = "dive.surface";
inline constexpr const char* kEmergencyState = "dive.emergency";
inline constexpr const char* kAbortedState = "dive.aborted";

struct Machine {
  statechart::Chart chart;
  std::vector<Guard> guards;            ///< By GuardId.
  std::vector<const StateSpec*> specs;  ///< By StateId; null for the root and the executive's own.
};

/// `mission` must outlive the machine.
[[nodiscard]] Machine build_machine(const Mission& mission);

/// The timeout of a leaf state, if it has one.
[[nodiscard]] const Timeout* timeout_of(const StateSpec& spec);

}  // namespace dive::mission
