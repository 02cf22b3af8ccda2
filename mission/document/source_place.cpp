#include "mission/document/source_place.h"

#include <algorithm>
#include <string_view>

namespace dive::mission {
namespace {

bool is_white_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

std::size_t past(std::string_view text, std::string_view end, std::size_t from) {
  const std::size_t found = text.find(end, from);
  return found == std::string_view::npos ? text.size() : found + end.size();
}

// The end of the tag that contains `at`; a '>' between quotes does not end it.
std::size_t past_tag(std::string_view text, std::size_t at) {
  char quote = '\0';
  for (; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != '\0') {
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '>') {
      return at + 1;
    }
  }
  return text.size();
}

constexpr std::string_view kSection = "<![CDATA[";

bool is_section(std::string_view text, std::size_t at) {
  return text.substr(at, kSection.size()) == kSection;
}

// The position after the comment, instruction, section, tag or byte of text at `at`; a tag changes
// the depth.
std::size_t past_token(std::string_view text, std::size_t at, int& depth) {
  if (text[at] != '<') return at + 1;
  if (text.substr(at, 4) == "<!--") return past(text, "-->", at);
  if (text.substr(at, 2) == "<?") return past(text, "?>", at);
  if (is_section(text, at)) return past(text, "]]>", at);
  const std::size_t end = past_tag(text, at);
  if (text.substr(at, 2) == "</") {
    --depth;
  } else if (text[end - 2] != '/') {
    ++depth;
  }
  return end;
}

// Number of bytes of the value, in UTF-8, of a character reference such as "&#233;".
std::size_t decoded_length(std::string_view reference) {
  if (reference.substr(0, 2) != "&#") return 1;  // one of the five predefined entities
  const bool hex = reference.size() > 2 && reference[2] == 'x';
  unsigned long code = 0;
  for (const char c : reference.substr(hex ? 3 : 2)) {
    if (c >= '0' && c <= '9') {
      code = code * (hex ? 16 : 10) + static_cast<unsigned long>(c - '0');
    } else if (hex && std::string_view("abcdefABCDEF").find(c) != std::string_view::npos) {
      code = code * 16 + static_cast<unsigned long>((c | 0x20) - 'a' + 10);
    }
  }
  return code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
}

}  // namespace

std::size_t offset_of(const SourceText& source, const Span& span) {
  const std::string_view line = source.line(span.line);
  if (line.data() == nullptr) return source.content().size();
  const auto line_start = static_cast<std::size_t>(line.data() - source.content().data());
  return line_start + static_cast<std::size_t>(std::max(span.column - 1, 0));
}

Span span_in_value(const SourceText& source, const XmlAttribute& attribute, std::size_t offset,
                   std::size_t length) {
  const std::string_view text = source.content();
  std::size_t at = offset_of(source, attribute.value_span);
  for (std::size_t decoded = 0; decoded < offset && at < text.size();) {
    if (text[at] == '&') {
      const std::size_t end = past(text, ";", at);
      decoded += decoded_length(text.substr(at, end - at));
      at = end;
    } else {
      // A line break of two bytes is one blank in the value.
      at += text.substr(at, 2) == "\r\n" ? 2 : 1;
      ++decoded;
    }
  }
  return source.span_at(at, length);
}

ElementExtent extent_of(const SourceText& source, const XmlElement& element) {
  const std::string_view text = source.content();
  ElementExtent extent;
  extent.begin = offset_of(source, element.span) - 1;
  extent.content = extent.content_end = extent.end = past_tag(text, extent.begin);
  if (text[extent.content - 2] == '/') return extent;
  for (int depth = 0; depth >= 0 && extent.end < text.size();) {
    extent.content_end = extent.end;
    extent.end = past_token(text, extent.end, depth);
  }
  return extent;
}

Span place_of_text(const SourceText& source, const XmlElement& element) {
  const std::string_view text = source.content();
  std::size_t at = past_tag(text, offset_of(source, element.span));
  for (int depth = 0; at < text.size() && depth >= 0; at = past_token(text, at, depth)) {
    if (depth > 0) continue;
    if (is_section(text, at)) return source.span_at(at, kSection.size());
    if (text[at] != '<' && !is_white_space(text[at])) {
      return source.span_at(at, std::min(text.find_first_of(" \t\r\n<", at), text.size()) - at);
    }
  }
  return element.span;
}

}  // namespace dive::mission
