#pragma once
// Judges a parsed document by the schema of its language (libxml2) and says what is wrong in words.

#include "common/diagnostic.h"
#include "common/xml.h"
#include "mission/document/language.h"

namespace dive::mission {

/// True when the document is valid. Else every mistake is reported, as far as one can go on after
/// it: a misspelt element is taken for the one probably meant, any other is left out. Codes:
/// XSD-ROOT, XSD-ELEMENT, XSD-MISSING-ELEMENT, XSD-ATTRIBUTE, XSD-MISSING-ATTRIBUTE, XSD-VALUE,
/// XSD-TEXT. Reads neither files nor the network, whatever xsi:schemaLocation says.
[[nodiscard]] bool check_schema(const XmlDocument& document, const Language& language,
                                Diagnostics& diagnostics);

}  // namespace dive::mission
