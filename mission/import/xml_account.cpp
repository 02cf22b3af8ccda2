#include "mission/import/xml_account.h"

#include <fmt/format.h>

#include "common/suggest.h"

namespace dive::mission {
namespace {

constexpr const char* kCode = "IMP-UNKNOWN";

}  // namespace

const XmlElement* XmlAccount::child(const XmlElement& parent, std::string_view name) {
  const XmlElement* child = parent.child(name);
  if (child != nullptr) read_.insert(child);
  return child;
}

const XmlAttribute* XmlAccount::attribute(const XmlElement& element, std::string_view name) {
  const XmlAttribute* attribute = element.attribute(name);
  if (attribute != nullptr) read_.insert(attribute);
  return attribute;
}

const std::string& XmlAccount::text(const XmlElement& element) {
  read_.insert(&element.text);
  return element.text;
}

void XmlAccount::report_rest(const XmlElement& root, std::span<const std::string> known,
                             ImportReport& report) const {
  if (!root.text.empty() && !read_.contains(&root.text)) {
    report.warning(kCode, root.span,
                   fmt::format("the text in '{}' is not understood and left out", root.name));
  }
  for (const XmlAttribute& attribute : root.attributes) {
    if (read_.contains(&attribute)) continue;
    report.warning(kCode, attribute.name_span,
                   fmt::format("the attribute {}=\"{}\" of '{}' is not understood and left out",
                               attribute.name, attribute.value, root.name));
  }
  for (const XmlElement& element : root.children) {
    if (!read_.contains(&element)) {
      const std::string hint = did_you_mean(element.name, known);
      const bool is_twice = hint == fmt::format("did you mean '{}'?", element.name);
      report.warning(kCode, element.span,
                     fmt::format("the element '{}' in '{}' is {} and left out", element.name,
                                 root.name, is_twice ? "not expected here" : "not understood"),
                     {}, is_twice ? "" : hint);
    }
    report_rest(element, known, report);
  }
}

std::string in_words(const XmlElement& element) {
  std::string words = fmt::format("'{}'", element.name);
  for (const XmlAttribute& attribute : element.attributes) {
    words += fmt::format(" {}=\"{}\"", attribute.name, attribute.value);
  }
  return words;
}

}  // namespace dive::mission
