#pragma once
// What two XML documents mean differently: missions, and maps. Layout, comments, the order of
// attributes and of elements that occur once, ways to write a number, and defaults that are written
// out make no difference.

#include <vector>

#include "common/xml.h"
#include "mission/diff/difference.h"

namespace dive::mission {

/// The differences in document order, named by a path of elements, each with its id or name:
/// "states/goto[gate]/@x". Elements are matched by name and id, or else by the event of a
/// transition, then by their order. Defaults are those of attributes that the caller added
/// (Language::add_defaults()).
[[nodiscard]] std::vector<Difference> document_differences(const XmlElement& a,
                                                           const XmlElement& b);

}  // namespace dive::mission
