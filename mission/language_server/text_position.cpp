#include "mission/language_server/text_position.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

namespace dive::mission {
namespace {

// Bytes of the character that begins with `lead`.
std::size_t bytes_of(unsigned char lead) {
  if (lead >= 0xF0U && lead < 0xF8U) return 4;
  if (lead >= 0xE0U && lead < 0xF0U) return 3;
  if (lead >= 0xC0U && lead < 0xE0U) return 2;
  return 1;
}

// The bytes of the first `units` code units, or all of them.
std::size_t bytes_of_units(std::string_view line, int units) {
  std::size_t at = 0;
  while (at < line.size() && units > 0) {
    const std::size_t bytes = bytes_of(static_cast<unsigned char>(line[at]));
    units -= bytes == 4 ? 2 : 1;
    at += bytes;
  }
  return std::min(at, line.size());
}

std::optional<unsigned> hex_digit(char c) {
  if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<unsigned>(c - 'a') + 10U;
  if (c >= 'A' && c <= 'F') return static_cast<unsigned>(c - 'A') + 10U;
  return std::nullopt;
}

constexpr std::string_view kScheme = "file://";

}  // namespace

int utf16_length(std::string_view text) {
  int units = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t bytes = bytes_of(static_cast<unsigned char>(text[at]));
    units += bytes == 4 ? 2 : 1;
    at += bytes;
  }
  return units;
}

std::size_t offset_of(std::string_view text, EditorPosition position) {
  std::size_t begin = 0;
  for (int line = 0; line < position.line; ++line) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) return text.size();
    begin = end + 1;
  }
  std::string_view line = text.substr(begin, text.find('\n', begin) - begin);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return begin + bytes_of_units(line, position.character);
}

EditorRange range_of(const Span& span, std::string_view source_line) {
  if (span.line < 1) return {};
  const auto before = static_cast<std::size_t>(std::max(span.column - 1, 0));
  const auto length = static_cast<std::size_t>(std::max(span.length, 1));
  const int start = utf16_length(source_line.substr(0, std::min(before, source_line.size())));
  const int width = before < source_line.size() ? utf16_length(source_line.substr(before, length))
                                                : static_cast<int>(length);
  return {{span.line - 1, start}, {span.line - 1, start + width}};
}

std::string path_of_uri(std::string_view uri) {
  if (!uri.starts_with(kScheme)) return {};
  uri.remove_prefix(kScheme.size());
  std::string path;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool is_coded = uri[i] == '%' && i + 2 < uri.size();
    const auto high = is_coded ? hex_digit(uri[i + 1]) : std::nullopt;
    const auto low = is_coded ? hex_digit(uri[i + 2]) : std::nullopt;
    if (high && low) {
      path += static_cast<char>(*high * 16U + *low);
      i += 2;
    } else {
      path += uri[i];
    }
  }
  return path;
}

std::string uri_of_path(std::string_view path) {
  std::string uri(kScheme);
  for (const char c : path) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                          (c >= '0' && c <= '9') ||
                          std::string_view("/-_.~").find(c) != std::string_view::npos;
    if (is_plain) {
      uri += c;
    } else {
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return uri;
}

}  // namespace dive::mission
