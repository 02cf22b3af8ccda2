#pragma once
// Where updates of the observed map are applied, each once: by the loop on board before a step, and
// by a replay in the same way from the log.

#include "mission/executive/io.h"
#include "planning/world/observed_map.h"

namespace dive::mission {

/// Scans may be this much newer than the tick in which they arrive, us: clocks differ.
inline constexpr Utime kMaxScanLead = 100'000;

/// Applies the obstacle updates of a tick to the owner's `map`, and sets the snapshot in `inputs`.
/// Updates that are not well-formed, not newer than the last of their source, or of the future
/// change nothing.
void update_map(planning::ObservedMap& map, StepInputs& inputs);

}  // namespace dive::mission
