#pragma once
// A language of ours as its schema (missions/*.xsd) declares it, in a form that error messages and
// defaults can be made from: which element may stand where, which attributes it takes, and what is
// expected of each in words. Judging a document is libxml2's work (schema.h), not this table's.

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/xml.h"

namespace dive::mission {

struct AttributeRule {
  std::string name;
  bool required = false;
  std::string default_value;         ///< Empty: none.
  std::string expected;              ///< In words: "a number from 0 to 100 (m)".
  std::vector<std::string> choices;  ///< Of an enumeration, else empty.
};

struct ElementRule {
  std::vector<AttributeRule> attributes;
  std::map<std::string, std::string, std::less<>> children;  ///< Name to type.
  std::vector<std::string> required_children;
  std::vector<std::string> one_of;  ///< Children of which there must be at least one.
  std::string text;  ///< What text is expected, in words, of an element that is nothing but text.

  [[nodiscard]] const AttributeRule* attribute(std::string_view name) const;
  [[nodiscard]] std::vector<std::string> attribute_names() const;
  [[nodiscard]] std::vector<std::string> child_names() const;
};

/// A schema that is compiled into the program.
struct SchemaSource {
  const char* file = "";           ///< Its name.
  const char* text = "";           ///< All of it.
  const char* root = "";           ///< The root element of the documents.
  const char* namespace_uri = "";  ///< And the namespace.
};

class Language {
 public:
  /// Demands a schema that is well-formed and declares what it refers to.
  explicit Language(const SchemaSource& source);

  [[nodiscard]] const SchemaSource& source() const { return source_; }

  /// Rule of the element called `name` in an element of type `parent_type`; nullptr where no such
  /// element may stand. The root's parent type is empty.
  [[nodiscard]] const ElementRule* rule(std::string_view parent_type, std::string_view name) const;
  /// Type of that element; empty where no such element may stand.
  [[nodiscard]] std::string type(std::string_view parent_type, std::string_view name) const;
  /// Rule of a type of the schema, which must exist.
  [[nodiscard]] const ElementRule& type_rule(std::string_view type) const;
  /// Elements in which an element called `name` may stand, in alphabetical order.
  [[nodiscard]] std::vector<std::string> parents_of(std::string_view name) const;

  /// Adds every attribute that is absent and has a default, placed at the element's own name.
  void add_defaults(XmlElement& root) const;
  /// The same of an element of that type.
  void add_defaults(XmlElement& element, std::string_view type) const;

 private:
  void add_type(const XmlElement& schema, const XmlElement& type);
  void collect(const XmlElement& schema, const XmlElement& part, ElementRule& rule) const;

  SchemaSource source_;
  std::map<std::string, ElementRule, std::less<>> types_;
};

/// The namespace of mission files.
inline constexpr const char* kMissionNamespace = "urn:dive:mission:1";

/// missions/mission.xsd.
[[nodiscard]] SchemaSource mission_schema();

}  // namespace dive::mission
