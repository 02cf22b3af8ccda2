#include "mission/states/state_elements.h"

#include <algorithm>

#include "mission/states/goal_sequence.h"
#include "mission/states/goto.h"
#include "mission/states/hold.h"
#include "mission/states/orbit.h"
#include "mission/states/retrace.h"
#include "mission/states/surface.h"
#include "mission/states/transect.h"
#include "mission/states/wreck_penetration.h"

namespace dive::mission {
namespace {

// clang-format off
constexpr StateElement kElements[] = {
    {"goto", read_goto},
    {"goal_sequence", read_goal_sequence},
    {"transect", read_transect},
    {"wreck_penetration", read_wreck_penetration},
    {"orbit", read_orbit, kOrbitRules},
    {"hold", read_hold},
    {"retrace", read_retrace},
    {"surface", read_surface},
};
// clang-format on

}  // namespace

std::span<const StateElement> state_elements() { return kElements; }

const StateElement* find_state_element(std::string_view name) {
  const auto* const found = std::ranges::find(kElements, name, &StateElement::name);
  return found == std::end(kElements) ? nullptr : found;
}

std::vector<Rule> state_rules() {
  std::vector<Rule> rules;
  for (const StateElement& element : kElements) {
    rules.insert(rules.end(), element.rules.begin(), element.rules.end());
  }
  return rules;
}

}  // namespace dive::mission
