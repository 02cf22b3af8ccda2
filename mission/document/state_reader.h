#pragma once
// The states of a mission, from elements that have passed the schema. What is common to all states
// is read here; what an element has of its own is read by its file in mission/states.

#include <optional>
#include <vector>

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

  // For the elements of mission/states.
  [[nodiscard]] const AttributeReader& attributes() const { return attributes_; }
  /// The goal that the attributes of an element give.
  [[nodiscard]] Goal goal(const XmlElement& element) const;
  /// The goals of all its elements <goal>.
  [[nodiscard]] std::vector<Goal> goals_in(const XmlElement& element) const;

 private:
  [[nodiscard]] StateSpec state(const XmlElement& element, bool overhead_above);
  void set_type(const XmlElement& element, StateSpec& spec) const;
  void read_content(const XmlElement& element, StateSpec& spec);
  [[nodiscard]] std::optional<Timeout> timeout(const XmlElement& element);
  [[nodiscard]] TransitionSpec transition(const XmlElement& element);
  [[nodiscard]] std::optional<Guard> guard(const XmlAttribute& cond);
  [[nodiscard]] std::vector<ActionSpec> actions(const XmlElement& element) const;

  const AttributeReader& attributes_;
  Diagnostics& diagnostics_;
};

}  // namespace dive::mission
