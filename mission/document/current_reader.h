#pragma once
// Reads the element `current` of a mission that has passed the schema. Private to
// mission/document.

#include "common/declared_current.h"
#include "common/diagnostic.h"
#include "common/xml.h"
#include "mission/document/attribute_reader.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// The declared current; still water if the element declares none, or after an error (MIS-CURRENT).
/// A table has become samples by expansion (expansion.h).
[[nodiscard]] Located<DeclaredCurrent> read_current(const XmlElement& element,
                                                    const AttributeReader& attributes,
                                                    Diagnostics& diagnostics);

}  // namespace dive::mission
