#pragma once
// The command that repeats a simulated dive.

#include <string>

#include "mission/simulation/simulated_dive.h"

namespace dive::mission {

/// "dive run MISSION --seed N [--vehicle FILE] [--set NAME=VALUE]... [--fault NAME@SECONDS]...",
/// which repeats the same ticks, for settings that differ from those of the mission only in seed,
/// named conditions and lasting faults; rest_s only ends a dive earlier. Numbers round-trip
/// exactly; the path is quoted for a shell where necessary.
[[nodiscard]] std::string run_command_for(const Mission& mission, const DiveSettings& settings);

}  // namespace dive::mission
