#pragma once
// Positions finer than the XML tree has: inside an attribute's value, and of stray text.

#include <cstddef>

#include "common/source_text.h"
#include "common/xml.h"

namespace dive::mission {

/// Byte offset of the start of `span`, which must point into `source`.
[[nodiscard]] std::size_t offset_of(const SourceText& source, const Span& span);

/// Source position of byte `offset` of an attribute's value: in the file a value may be longer
/// ("&lt;" is one byte of the value). `length` bytes are underlined.
[[nodiscard]] Span span_in_value(const SourceText& source, const XmlAttribute& attribute,
                                 std::size_t offset, std::size_t length);

/// Byte offsets of an element's content: from after its start tag to its end tag, or to the end of
/// an empty tag; `end` is past the whole element.
struct ElementExtent {
  std::size_t begin = 0;  ///< Offset of the '<'.
  std::size_t content = 0;
  std::size_t content_end = 0;
  std::size_t end = 0;
};
[[nodiscard]] ElementExtent extent_of(const SourceText& source, const XmlElement& element);

/// The first word of the text directly inside `element`; the element's name if there is none.
[[nodiscard]] Span place_of_text(const SourceText& source, const XmlElement& element);

}  // namespace dive::mission
