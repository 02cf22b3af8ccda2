#pragma once
// What the vehicle does at each fault, in words: the mission's failsafes grouped by their action,
// and what each state does of its own.

#include <string>
#include <vector>

#include "mission/check/check.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// Failsafes with one action.
struct AbortRow {
  std::vector<std::string> faults;  ///< "charge below 35 %", in the order of FailsafeKind.
  std::string in_open_water;
  std::string under_overhead;
};

/// The strongest action first; then what is only reported, and what is not watched at all.
/// Failsafes that need a sensor which the mission does not use are left out.
[[nodiscard]] std::vector<AbortRow> abort_table(const Mission& mission);

/// What a state does by itself, before any failsafe. Empty: nothing.
struct StateReaction {
  std::string state;
  std::string at_timeout;    ///< "2:30 -> out"
  std::string without_path;  ///< State entered when no path is found.
  std::string otherwise;     ///< "-> wreck-exit if penetration > 25 m", and events of failsafes.
};

/// The states on the route of the checked mission, in its order.
[[nodiscard]] std::vector<StateReaction> state_reactions(const Mission& mission,
                                                         const CheckReport& report);

}  // namespace dive::mission
