#pragma once
// Converts the tree of a valid document to typed values.

#include "common/xml.h"
#include "mission/document/language.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// `document` has passed check_schema(). Conditions are parsed here: an invalid one gives the
/// diagnostic MIS-COND and leaves its transition without a guard. `map_path` stays empty.
[[nodiscard]] Mission read_mission(XmlDocument document, const Language& language,
                                   Diagnostics& diagnostics);

}  // namespace dive::mission
