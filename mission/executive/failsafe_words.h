#pragma once
// The cause of an active failsafe, as a sentence with the current values. Private to
// mission/executive.

#include <string>

#include "behaviors/failsafes.h"
#include "mission/document/mission.h"
#include "mission/executive/situation.h"

namespace dive::mission {

[[nodiscard]] std::string describe(behaviors::FailsafeKind kind, const Mission& mission,
                                   const Situation& situation);

}  // namespace dive::mission
