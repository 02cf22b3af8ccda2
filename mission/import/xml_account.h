#pragma once
// Tracks which parts of an XML document were read, so that no part is omitted silently.

#include <span>
#include <string>
#include <string_view>
#include <unordered_set>

#include "common/xml.h"
#include "mission/import/import_report.h"

namespace dive::mission {

/// Refers to the elements and attributes of a tree that must not move.
class XmlAccount {
 public:
  /// The child of that name, or nullptr; marks it as read.
  const XmlElement* child(const XmlElement& parent, std::string_view name);
  /// The attribute of that name, or nullptr; marks it as read.
  const XmlAttribute* attribute(const XmlElement& element, std::string_view name);
  const std::string& text(const XmlElement& element);
  void take(const XmlElement& element) { read_.insert(&element); }

  /// Reports a warning for every element, attribute and text below `root` that was not read. A name
  /// close to one of `known` gets a hint.
  void report_rest(const XmlElement& root, std::span<const std::string> known,
                   ImportReport& report) const;

 private:
  std::unordered_set<const void*> read_;
};

/// The name of an element in findings: `'name' a="1" b="2"`.
[[nodiscard]] std::string in_words(const XmlElement& element);

}  // namespace dive::mission
