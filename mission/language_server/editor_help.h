#pragma once
// What an editor shows at a place of a mission, from the schema alone: completions and meanings.

#include <string>
#include <string_view>
#include <vector>

#include "mission/document/language.h"
#include "mission/language_server/xml_cursor.h"

namespace dive::mission {

enum class CompletionKind { kElement, kAttribute, kValue };

struct Completion {
  CompletionKind kind = CompletionKind::kElement;
  std::string label;   ///< Name of the element or attribute, or the value.
  std::string insert;  ///< Text in place of what is written from `XmlCursor::begin` to the cursor.
  std::string detail;  ///< Short: the expected value.
  std::string documentation;
  bool is_required = false;
};

/// Elements allowed where the cursor stands, attributes that its tag lacks, or the values of its
/// attribute. Empty where nothing of the language may stand.
[[nodiscard]] std::vector<Completion> completions(const XmlCursor& cursor,
                                                  const Language& language);

/// The meaning of the element or attribute at the cursor; empty if unknown.
[[nodiscard]] std::string meaning(const XmlCursor& cursor, const Language& language);

}  // namespace dive::mission
