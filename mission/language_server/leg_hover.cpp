#include "mission/language_server/leg_hover.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "mission/states/state_elements.h"

namespace dive::mission {
namespace {

constexpr std::array<std::string_view, 3> kParts = {"goal", "entry", "exit"};
// Atomic states without goals.
constexpr std::array<std::string_view, 3> kStill = {"hold", "surface", "retrace"};

bool holds_goals(std::string_view element) {
  if (std::ranges::find(kParts, element) != kParts.end()) return true;
  return find_state_element(element) != nullptr &&
         std::ranges::find(kStill, element) == kStill.end();
}

// Entry and exit have no id: their goals are named after their state.
std::string goal_at(const XmlCursor& cursor) {
  const OpenElement& element = cursor.elements.back();
  const bool is_part = element.name == "entry" || element.name == "exit";
  if (!is_part || cursor.elements.size() < 2) return element.value("id");
  return cursor.elements[cursor.elements.size() - 2].value("id") + "-" + element.name;
}

}  // namespace

bool makes_legs(const XmlCursor& cursor) {
  return !cursor.elements.empty() && cursor.place != CursorPlace::kElsewhere &&
         holds_goals(cursor.elements.back().name) && !goal_at(cursor).empty();
}

std::vector<CheckedLeg> legs_at(const XmlCursor& cursor, const std::vector<CheckedLeg>& legs) {
  std::vector<CheckedLeg> result;
  if (!makes_legs(cursor)) return result;
  const std::string id = goal_at(cursor);
  const auto is_goal = [&](const CheckedLeg& leg) { return leg.goal == id; };
  std::ranges::copy_if(legs, std::back_inserter(result), is_goal);
  if (!result.empty()) return result;
  // A penetration has parts: its states are ID-entry, ID-inside, ID-exit.
  const auto is_of_state = [&](const CheckedLeg& leg) {
    return leg.state == id || leg.state.starts_with(id + "-");
  };
  std::ranges::copy_if(legs, std::back_inserter(result), is_of_state);
  return result;
}

std::string describe(const std::vector<CheckedLeg>& legs) {
  std::string text;
  for (const CheckedLeg& leg : legs) {
    if (!text.empty()) text += "\n\n";
    if (!leg.has_path) {
      text += fmt::format("**{}**: no path: {}", leg.goal, leg.reason);
      continue;
    }
    text += fmt::format("**{}**: certified clearance {:.2f} m (required {:.2f} m), {:.1f} m long",
                        leg.goal, leg.clearance_m, leg.required_m, leg.length_m);
    if (std::isfinite(leg.margin_sigma)) {
      text += fmt::format(", margin {:.1f} sigma at {}", leg.margin_sigma, leg.obstacle);
    }
  }
  return text;
}

}  // namespace dive::mission
