#pragma once
// The dive card: a checked mission on one printed A4 page, to be read under water and on deck
// (black on white, large type, no network, no script).
//
// Everything on it is what `dive check` found or what the mission says; this module only selects
// and words it. A page has room for a bounded number of rows, so longer routes are summarised
// (card_legs.h) and longer texts cut; the card says where.

#include <string>
#include <string_view>

#include "common/diagnostic.h"
#include "mission/check/check.h"
#include "mission/document/mission.h"

namespace dive::mission {

struct CardSource {
  const Mission& mission;
  const CheckReport& report;       ///< Of a mission that is ready to dive.
  const Diagnostics& diagnostics;  ///< Its warnings are on the card.
  std::string_view map;            ///< Text of the map; empty without one.
  std::string_view vehicle;        ///< Text of the vehicle's description.
  std::string_view version;        ///< Version of this program.
};

/// The card as one HTML file. Demands that `diagnostics` has no error.
[[nodiscard]] std::string render_card(const CardSource& source);

}  // namespace dive::mission
