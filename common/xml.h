#pragma once
// XML from a person or a remote source: parsed by libxml2 with all dangerous features off, bounded,
// and converted to a plain tree in which every name and value has its position in the file.
//
// Rejected: DOCTYPE (and with it every custom entity), encodings other than UTF-8, more than
// XmlLimits allows. Never enabled: XInclude, network, entity substitution, huge documents.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/diagnostic.h"
#include "common/source_text.h"

namespace dive {

struct XmlAttribute {
  std::string name;
  std::string namespace_uri;  ///< Empty for the usual unprefixed attribute.
  std::string value;
  Span name_span;
  Span value_span;  ///< Position of the value between the quotes.
};

struct XmlElement {
  std::string name;           ///< Local name.
  std::string namespace_uri;  ///< Empty if in no namespace.
  Span span;                  ///< Position of the name in the start tag.
  std::string text;           ///< Character data of the element itself, concatenated and trimmed.
  std::vector<XmlAttribute> attributes;
  std::vector<XmlElement> children;

  [[nodiscard]] const XmlAttribute* attribute(std::string_view attribute_name) const;
  /// First child of that local name, or nullptr.
  [[nodiscard]] const XmlElement* child(std::string_view child_name) const;
};

struct XmlDocument {
  SourceText source;
  XmlElement root;
};

struct XmlLimits {
  std::size_t max_bytes = 1U << 20U;
  int max_depth = 48;
  std::size_t max_elements = 20'000;
  std::size_t max_attributes = 256;  ///< Limit per element: libxml2 compares all pairs.
};

/// Parses `source`; after any error adds diagnostics (codes XML-*) and returns nothing.
[[nodiscard]] std::optional<XmlDocument> parse_xml(SourceText source, const XmlLimits& limits,
                                                   Diagnostics& diagnostics);

/// read_source_text and parse_xml; an unreadable file gives the diagnostic FILE-UNREADABLE.
[[nodiscard]] std::optional<XmlDocument> read_xml(const std::string& path, const XmlLimits& limits,
                                                  Diagnostics& diagnostics);

/// A finite number in the C locale; blanks around it are allowed, other text is not. No NaN, INF or
/// hex.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

/// Exactly `count` finite numbers separated by blanks.
[[nodiscard]] std::optional<std::vector<double>> parse_numbers(std::string_view text,
                                                               std::size_t count);

/// Escapes text for an element or for an attribute in double quotes.
[[nodiscard]] std::string escape_xml(std::string_view text);

}  // namespace dive
