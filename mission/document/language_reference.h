#pragma once
// The reference of a language as a page of Markdown, made from its schema.

#include <string>

#include "mission/document/language.h"

namespace dive::mission {

/// One section for each type of element that the root contains, in the order in which a reader
/// meets them: meaning, example, attributes with values, unit and default, and children.
[[nodiscard]] std::string language_reference(const Language& language);

}  // namespace dive::mission
