#pragma once
// The states of a mission, from elements that have passed the schema. `transect` becomes a sequence
// of goals and `wreck_penetration` a state with child states, so that no other code handles them.
// Private to mission/document.

#include "common/diagnostic.h"
#include "common/xml.h"
#include "mission/document/attribute_reader.h"
#include "mission/document/mission.h"

namespace dive::mission {

class StateReader {
 public:
  /// Both must outlive the reader. Reports conditions that cannot be parsed and invalid timeouts.
  StateReader(const AttributeReader& attributes, Diagnostics& diagnostics)
      : attributes_(attributes), diagnostics_(diagnostics) {}

  [[nodiscard]] StateSpec read(const XmlElement& element) { return state(element, false); }

 private:
  [[nodiscard]] StateSpec state(const XmlElement& element, bool overhead_above);
  void set_type_and_leaf(const XmlElement& element, StateSpec& spec);
  void read_content(const XmlElement& element, StateSpec& spec);
  [[nodiscard]] Goal goal(const XmlElement& element) const;
  [[nodiscard]] std::optional<Timeout> timeout(const XmlElement& element);
  [[nodiscard]] TransitionSpec transition(const XmlElement& element);
  [[nodiscard]] std::optional<Guard> guard(const XmlAttribute& cond);
  [[nodiscard]] std::vector<ActionSpec> actions(const XmlElement& element) const;

  // Defined in mission/states/transect.cpp.
  [[nodiscard]] GoalSequenceState transect(const XmlElement& element) const;
  // Defined in mission/states/wreck_penetration.cpp.
  [[nodiscard]] StateSpec penetration(const XmlElement& element);
  [[nodiscard]] StateSpec penetration_part(const XmlElement& element, const char* part,
                                           Leaf leaf) const;
  [[nodiscard]] Goal penetration_waypoint(const XmlElement& element, const XmlElement& waypoint,
                                          const char* part) const;
  [[nodiscard]] TransitionSpec turn_back(const XmlElement& element) const;

  const AttributeReader& attributes_;
  Diagnostics& diagnostics_;
};

}  // namespace dive::mission
