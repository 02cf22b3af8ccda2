#pragma once
// Locates the map of a mission: beneath the mission's own folder, with symbolic links resolved.

#include "common/diagnostic.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// Sets `mission.map_path` if a map is named. Codes: MIS-MAP-OUTSIDE, MIS-MAP-NOT-FOUND.
void resolve_map(Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
