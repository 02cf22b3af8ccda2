#pragma once
// Validates a parsed document by the schema of its language (libxml2) and reports mistakes in
// words.

#include "common/diagnostic.h"
#include "common/xml.h"
#include "mission/document/language.h"

namespace dive::mission {

/// True if the document is valid. Otherwise reports every mistake that can be reached: a misspelt
/// element is treated as the one probably meant, any other unknown element is skipped. Codes:
/// XSD-ROOT, XSD-ELEMENT, XSD-MISSING-ELEMENT, XSD-ATTRIBUTE, XSD-MISSING-ATTRIBUTE, XSD-VALUE,
/// XSD-TEXT. Reads neither files nor the network, whatever xsi:schemaLocation contains.
[[nodiscard]] bool check_schema(const XmlDocument& document, const Language& language,
                                Diagnostics& diagnostics);

}  // namespace dive::mission
