#pragma once
// What an editor shows on a leg of a mission: the clearance that its plan is certified for.

#include <string>
#include <vector>

#include "mission/language_server/xml_cursor.h"

namespace dive::mission {

/// The plan of one leg, from a static check.
struct CheckedLeg {
  std::string state;
  std::string goal;
  bool has_path = false;     ///< An accepted path.
  std::string reason;        ///< Without a path: why.
  double clearance_m = 0.0;  ///< Certified.
  double required_m = 0.0;
  double length_m = 0.0;
  double margin_sigma = 0.0;  ///< Infinite if not predicted.
  std::string obstacle;       ///< The obstacle of the margin.
};

/// The legs that the element at the cursor makes: those to a goal, or all of a state.
[[nodiscard]] std::vector<CheckedLeg> legs_at(const XmlCursor& cursor,
                                              const std::vector<CheckedLeg>& legs);

/// True if the element at the cursor makes legs.
[[nodiscard]] bool makes_legs(const XmlCursor& cursor);

/// One line of Markdown for each leg.
[[nodiscard]] std::string describe(const std::vector<CheckedLeg>& legs);

}  // namespace dive::mission
