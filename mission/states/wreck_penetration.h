#pragma once
// <wreck_penetration>: in and out again, read as a compound state with one child state per part.

namespace dive {
struct XmlElement;
}

namespace dive::mission {

class StateReader;
struct StateSpec;

void read_wreck_penetration(const XmlElement& element, const StateReader& reader, StateSpec& spec);

}  // namespace dive::mission
