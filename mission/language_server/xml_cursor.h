#pragma once
// Where in an XML text a cursor stands. The text is being typed, so it need not be well-formed.

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace dive::mission {

struct OpenElement {
  std::string name;                                             ///< As far as it is written.
  std::vector<std::pair<std::string, std::string>> attributes;  ///< Name and value.

  /// The value; empty if absent.
  [[nodiscard]] std::string value(std::string_view attribute) const;
};

enum class CursorPlace {
  kContent,         ///< Between tags.
  kElementName,     ///< In the name of a start tag.
  kTag,             ///< In a start tag, where an attribute may begin, or in the name of one.
  kAttributeValue,  ///< Between the quotes.
  kElsewhere,       ///< In a comment, an end tag, an instruction, or between '=' and a quote.
};

struct XmlCursor {
  CursorPlace place = CursorPlace::kContent;
  /// The elements around the cursor, the outermost first. In a start tag its element is the last,
  /// with the attributes of the whole tag.
  std::vector<OpenElement> elements;
  std::string attribute;  ///< kAttributeValue and names in kTag: the attribute.
  std::size_t begin = 0;  ///< Offset of the word before the cursor.
};

/// The place of the byte offset `at`.
[[nodiscard]] XmlCursor xml_cursor(std::string_view text, std::size_t at);

}  // namespace dive::mission
