#pragma once
// <transect>: rows, read as one sequence of goals: the ends of the rows.

namespace dive {
struct XmlElement;
}

namespace dive::mission {

class StateReader;
struct StateSpec;

void read_transect(const XmlElement& element, const StateReader& reader, StateSpec& spec);

}  // namespace dive::mission
