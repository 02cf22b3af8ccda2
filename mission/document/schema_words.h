#pragma once
// The sentences about what a schema does not allow.

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
  /// A known element in the wrong place, or once too often; `expected` may stand there instead.
  void misplaced_element(const XmlElement& element, const XmlElement& parent,
                         const std::vector<std::string>& expected);
  /// `expected` might stand where the element ends; of these one is needed, or several.
  void missing_children(const XmlElement& element, const std::string& type,
                        const std::vector<std::string>& expected);
  void unknown_attribute(const XmlElement& element, const std::string& type,
                         const std::string& name);
  /// Says nothing where an unknown attribute was probably meant to be it.
  void missing_attribute(const XmlElement& element, const std::string& type,
                         const std::string& name);
  /// `attribute` is empty for the element's text; `reason` is libxml2's, for what we cannot
  /// explain.
  void bad_value(const XmlElement& element, const std::string& type, const std::string& attribute,
                 const std::string& reason);
  void stray_text(const XmlElement& element);

 private:
  const SourceText& source_;
  const Language& language_;
  Diagnostics& diagnostics_;
};

}  // namespace dive::mission
