#pragma once
// One of our XML languages as its schema (missions/*.xsd) declares it, in a form that serves error
// messages and defaults: the elements allowed in each place, their attributes, and the values
// expected of each, in words. libxml2 validates documents (schema.h), not this table.

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
  std::vector<std::string> choices;  ///< Values of an enumeration, else empty.
  std::string documentation;         ///< Its meaning, as one line of text.
};

struct ChildRule {
  std::string name;
  std::string type;
  bool is_required = false;
  bool may_repeat = false;
  int min_count = 1;          ///< Least number in one parent, where it is required.
  int max_count = 0;          ///< Largest number in one parent; 0 if the schema states none.
  std::string documentation;  ///< Its meaning, as one line of text.
  std::string example;        ///< As it may be written; may be empty.
};

struct ElementRule {
  std::string documentation;          ///< Of the type, as one line of text; may be empty.
  std::vector<ChildRule> child_list;  ///< In the order of the schema.
  std::vector<AttributeRule> attributes;
  std::map<std::string, std::string, std::less<>> children;  ///< Name to type.
  std::vector<std::string> required_children;
  std::vector<std::string> one_of;  ///< Children, at least one of which is required.
  std::string text;  ///< Expected text, in words, of an element that contains only text.

  [[nodiscard]] const AttributeRule* attribute(std::string_view name) const;
  /// Null where no such child is allowed.
  [[nodiscard]] const ChildRule* child(std::string_view name) const;
  [[nodiscard]] std::vector<std::string> attribute_names() const;
  [[nodiscard]] std::vector<std::string> child_names() const;
};

/// A schema that is compiled into the program.
struct SchemaSource {
  const char* file = "";           ///< Name of the schema file.
  const char* text = "";           ///< Its full text.
  const char* root = "";           ///< Root element of the documents.
  const char* namespace_uri = "";  ///< Namespace of the documents.
};

class Language {
 public:
  /// Requires a schema that is well-formed and declares everything it refers to.
  explicit Language(const SchemaSource& source);

  [[nodiscard]] const SchemaSource& source() const { return source_; }

  /// Rule of the element `name` in an element of type `parent_type`; nullptr where the element is
  /// not allowed. The root's parent type is empty.
  [[nodiscard]] const ElementRule* rule(std::string_view parent_type, std::string_view name) const;
  /// Type of that element; empty where the element is not allowed.
  [[nodiscard]] std::string type(std::string_view parent_type, std::string_view name) const;
  /// Rule of a type of the schema; the type must exist.
  [[nodiscard]] const ElementRule& type_rule(std::string_view type) const;
  /// Elements that allow an element called `name`, in alphabetical order.
  [[nodiscard]] std::vector<std::string> parents_of(std::string_view name) const;

  /// Adds every absent attribute that has a default, with the position of the element's name.
  void add_defaults(XmlElement& root) const;
  /// Adds the defaults of an element of the given type.
  void add_defaults(XmlElement& element, std::string_view type) const;

 private:
  void add_type(const XmlElement& schema, const XmlElement& type);
  void collect(const XmlElement& schema, const XmlElement& part, bool is_in_loop,
               ElementRule& rule) const;

  SchemaSource source_;
  std::map<std::string, ElementRule, std::less<>> types_;
};

/// The namespace of mission files.
inline constexpr const char* kMissionNamespace = "urn:dive:mission:1";

/// missions/mission.xsd.
[[nodiscard]] SchemaSource mission_schema();

}  // namespace dive::mission
