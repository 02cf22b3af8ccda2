#pragma once
// The registry: every element of a mission that steers the vehicle. A new one is entered in
// state_elements.cpp, and nowhere else in the code: doc/how-to/add-a-behavior.md.

#include <span>
#include <string_view>
#include <vector>

#include "common/xml.h"
#include "mission/document/rules.h"
#include "mission/document/state_reader.h"

namespace dive::mission {

struct StateElement {
  std::string_view name;  ///< Name of the element.
  /// Reads the element, which has passed the schema, into `spec`. Id, overhead, timeout,
  /// transitions, actions and <replan> have been read already.
  void (*read)(const XmlElement& element, const StateReader& reader, StateSpec& spec);
  std::span<const Rule> rules = {};  ///< Rules of this element alone.
};

[[nodiscard]] std::span<const StateElement> state_elements();
/// The element of that name, or nullptr.
[[nodiscard]] const StateElement* find_state_element(std::string_view name);
/// The rules of all of them.
[[nodiscard]] std::vector<Rule> state_rules();

}  // namespace dive::mission
