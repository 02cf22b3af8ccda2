#pragma once
// Where the map of a mission is: beneath the mission's own folder, symbolic links followed.

#include "common/diagnostic.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// Sets `mission.map_path`, unless no map is named. Codes: MIS-MAP-OUTSIDE, MIS-MAP-NOT-FOUND.
void resolve_map(Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
