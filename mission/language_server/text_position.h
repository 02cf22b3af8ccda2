#pragma once
// Positions of the Language Server Protocol: lines and UTF-16 code units, both from 0.

#include <cstddef>
#include <string>
#include <string_view>

#include "common/source_text.h"

namespace dive::mission {

struct EditorPosition {
  int line = 0;
  int character = 0;  ///< UTF-16 code units from the beginning of the line.
};

struct EditorRange {
  EditorPosition start;
  EditorPosition end;
};

/// Number of UTF-16 code units of a text in UTF-8; a byte that is not UTF-8 counts as one.
[[nodiscard]] int utf16_length(std::string_view text);

/// Byte offset of a position, clamped to the end of its line and of the text.
[[nodiscard]] std::size_t offset_of(std::string_view text, EditorPosition position);

/// The range of a span in the line `source_line`; a span without a position is at the beginning of
/// the file, one without a length takes one character.
[[nodiscard]] EditorRange range_of(const Span& span, std::string_view source_line);

/// "file:///a%20b.xml" to "/a b.xml"; empty for any other scheme.
[[nodiscard]] std::string path_of_uri(std::string_view uri);
[[nodiscard]] std::string uri_of_path(std::string_view path);

}  // namespace dive::mission
