#pragma once
// Locates the maps of a mission: beneath the mission's own folder, with symbolic links resolved.

#include "common/diagnostic.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// Sets `mission.map_path` and `mission.simulation_map_path` if they are named. Codes:
/// MIS-MAP-OUTSIDE, MIS-MAP-NOT-FOUND.
void resolve_maps(Mission& mission, Diagnostics& diagnostics);

/// Reports a map (SDF, accepted by the reader of maps) whose stated origin is not that of the
/// mission. Codes: MIS-MAP-ORIGIN, MAP-ORIGIN, MAP-NUMBER.
void check_map_origin(const Mission& mission, const SourceText& map, Diagnostics& diagnostics);

}  // namespace dive::mission
