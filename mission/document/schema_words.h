#pragma once
// The messages about violations of a schema.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/diagnostic.h"
#include "common/xml.h"
#include "mission/document/language.h"

namespace dive::mission {

/// `type` is always the schema's type of `element`. Keeps references to all three.
class SchemaWords {
 public:
  SchemaWords(const SourceText& source, const Language& language, Diagnostics& diagnostics)
      : source_(source), language_(language), diagnostics_(diagnostics) {}

  void wrong_root(const XmlElement& root);
  /// Returns the name probably meant.
  std::optional<std::string> unknown_element(const XmlElement& element, const XmlElement& parent,
                                             const std::string& parent_type);
  /// A known element in the wrong place, or repeated too often; `expected` may stand there instead.
  void misplaced_element(const XmlElement& element, const XmlElement& parent,
                         const std::string& parent_type, const std::vector<std::string>& expected);
  /// `expected` may stand where the element ends; one or several of these are required.
  void missing_children(const XmlElement& element, const std::string& type,
                        const std::vector<std::string>& expected);
  void unknown_attribute(const XmlElement& element, const std::string& type,
                         const std::string& name);
  /// Reports nothing where an unknown attribute was probably meant to be this one.
  void missing_attribute(const XmlElement& element, const std::string& type,
                         const std::string& name);
  /// `attribute` is empty for the element's text; `reason` is libxml2's message, used where we
  /// cannot explain the mistake.
  void bad_value(const XmlElement& element, const std::string& type, const std::string& attribute,
                 const std::string& reason);
  void stray_text(const XmlElement& element);

 private:
  const SourceText& source_;
  const Language& language_;
  Diagnostics& diagnostics_;
};

}  // namespace dive::mission
