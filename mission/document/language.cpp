#include "mission/document/language.h"

#include <set>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"

namespace dive::mission {

extern const char kMissionXsd[];

namespace {

// The top-level declaration of the given kind and name.
const XmlElement& declaration(const XmlElement& schema, std::string_view kind,
                              std::string_view name) {
  for (const XmlElement& element : schema.children) {
    const XmlAttribute* attribute = element.attribute("name");
    if (element.name == kind && attribute != nullptr && attribute->value == name) return element;
  }
  DIVE_DEMAND(false && "the schema refers to something it does not declare");
  return schema;
}

std::string value_of(const XmlElement& element, std::string_view attribute) {
  const XmlAttribute* found = element.attribute(attribute);
  return found == nullptr ? std::string() : found->value;
}

// The text of that part of an annotation, with single spaces between its words.
std::string annotated(const XmlElement& declared, std::string_view part) {
  const XmlElement* annotation = declared.child("annotation");
  const XmlElement* words = annotation == nullptr ? nullptr : annotation->child(part);
  if (words == nullptr) return {};
  std::istringstream stream(words->text);
  std::string text;
  for (std::string word; stream >> word;) text += text.empty() ? word : " " + word;
  return text;
}

// A number of occurrences that the schema states, or else `otherwise`.
int count_of(const std::string& occurs, int otherwise) {
  return occurs.empty() || occurs == "unbounded" ? otherwise : std::stoi(occurs);
}

// `part` is the model group that contains the element.
ChildRule child_rule(const XmlElement& element, const XmlElement& part, bool is_in_loop) {
  const std::string most = value_of(element, "maxOccurs");
  const std::string least = value_of(element, "minOccurs");
  const bool is_optional = least == "0" || part.name == "choice";
  return {value_of(element, "name"),
          value_of(element, "type"),
          !is_optional,
          is_in_loop || (!most.empty() && most != "1"),
          count_of(least, 1),
          is_in_loop ? 0 : count_of(most, 0),
          annotated(element, "documentation"),
          annotated(element, "appinfo")};
}

bool repeats(const XmlElement& part) {
  const std::string most = value_of(part, "maxOccurs");
  return !most.empty() && most != "1";
}

std::string one_of(const std::vector<std::string>& choices) {
  std::string text = choices.size() == 1 ? "" : "one of ";
  for (std::size_t i = 0; i < choices.size(); ++i) {
    text += fmt::format("{}'{}'", i == 0 ? "" : ", ", choices[i]);
  }
  return text;
}

// The description in a simple type: its xs:appinfo, or the values of its enumeration.
void describe(const XmlElement& simple_type, AttributeRule& rule) {
  rule.expected = annotated(simple_type, "appinfo");
  if (const XmlElement* restriction = simple_type.child("restriction")) {
    for (const XmlElement& facet : restriction->children) {
      if (facet.name == "enumeration") rule.choices.push_back(value_of(facet, "value"));
    }
  }
  if (!rule.choices.empty()) rule.expected = one_of(rule.choices);
}

AttributeRule attribute_rule(const XmlElement& schema, const XmlElement& attribute) {
  AttributeRule rule;
  rule.name = value_of(attribute, "name");
  rule.required = value_of(attribute, "use") == "required";
  rule.default_value = value_of(attribute, "default");
  rule.documentation = annotated(attribute, "documentation");
  describe(declaration(schema, "simpleType", value_of(attribute, "type")), rule);
  return rule;
}

}  // namespace

SchemaSource mission_schema() { return {"mission.xsd", kMissionXsd, "mission", kMissionNamespace}; }

const AttributeRule* ElementRule::attribute(std::string_view name) const {
  for (const AttributeRule& candidate : attributes) {
    if (candidate.name == name) return &candidate;
  }
  return nullptr;
}

const ChildRule* ElementRule::child(std::string_view name) const {
  for (const ChildRule& candidate : child_list) {
    if (candidate.name == name) return &candidate;
  }
  return nullptr;
}

std::vector<std::string> ElementRule::attribute_names() const {
  std::vector<std::string> names;
  for (const AttributeRule& attribute : attributes) names.push_back(attribute.name);
  return names;
}

std::vector<std::string> ElementRule::child_names() const {
  std::vector<std::string> names;
  for (const auto& [name, type] : children) names.push_back(name);
  return names;
}

Language::Language(const SchemaSource& source) : source_(source) {
  Diagnostics diagnostics;
  const std::optional<XmlDocument> schema =
      parse_xml(SourceText(source.file, source.text), XmlLimits{}, diagnostics);
  DIVE_DEMAND(schema);
  ElementRule top;
  for (const XmlElement& element : schema->root.children) {
    if (element.name == "complexType") add_type(schema->root, element);
    if (element.name == "simpleType") {
      AttributeRule text;
      describe(element, text);
      types_[value_of(element, "name")].text = text.expected;
    }
    if (element.name == "element") {
      top.children.emplace(value_of(element, "name"), value_of(element, "type"));
      top.child_list.push_back(child_rule(element, schema->root, false));
    }
  }
  types_.emplace("", std::move(top));
}

void Language::add_type(const XmlElement& schema, const XmlElement& type) {
  ElementRule rule;
  rule.documentation = annotated(type, "documentation");
  collect(schema, type, false, rule);
  types_.emplace(value_of(type, "name"), std::move(rule));
}

// Collects attributes and child elements, through groups, regardless of order and number.
void Language::collect(const XmlElement& schema, const XmlElement& part, bool is_in_loop,
                       ElementRule& rule) const {
  for (const XmlElement& element : part.children) {
    if (element.name == "attribute") {
      rule.attributes.push_back(attribute_rule(schema, element));
    } else if (element.name == "element") {
      rule.children.emplace(value_of(element, "name"), value_of(element, "type"));
      rule.child_list.push_back(child_rule(element, part, is_in_loop));
      const bool in_all = part.name == "all" || part.name == "sequence";
      if (in_all && value_of(element, "minOccurs").empty()) {
        rule.required_children.push_back(value_of(element, "name"));
      }
    } else if (element.name == "group" || element.name == "attributeGroup") {
      collect(schema, declaration(schema, element.name, value_of(element, "ref")),
              is_in_loop || repeats(element), rule);
    } else if (element.name == "all" || element.name == "choice" || element.name == "sequence") {
      collect(schema, element, is_in_loop || repeats(element), rule);
      if (element.name == "choice" && part.name == "sequence" &&
          value_of(element, "minOccurs").empty()) {
        for (const XmlElement& one : element.children) rule.one_of.push_back(value_of(one, "name"));
      }
    }
  }
}

std::string Language::type(std::string_view parent_type, std::string_view name) const {
  const auto parent = types_.find(parent_type);
  if (parent == types_.end()) return {};
  const auto child = parent->second.children.find(name);
  return child == parent->second.children.end() ? std::string() : child->second;
}

const ElementRule* Language::rule(std::string_view parent_type, std::string_view name) const {
  const std::string found = type(parent_type, name);
  const auto rule = found.empty() ? types_.end() : types_.find(found);
  return rule == types_.end() ? nullptr : &rule->second;
}

const ElementRule& Language::type_rule(std::string_view type) const {
  const auto rule = types_.find(type);
  DIVE_DEMAND(rule != types_.end());
  return rule->second;
}

std::vector<std::string> Language::parents_of(std::string_view name) const {
  std::set<std::string> parents;
  for (const auto& [outer_type, outer] : types_) {
    for (const auto& [parent, parent_type] : outer.children) {
      if (!type(parent_type, name).empty()) parents.insert(parent);
    }
  }
  return {parents.begin(), parents.end()};
}

void Language::add_defaults(XmlElement& root) const { add_defaults(root, type("", root.name)); }

void Language::add_defaults(XmlElement& element, std::string_view type) const {
  const auto rule = types_.find(type);
  if (rule == types_.end()) return;
  for (const AttributeRule& attribute : rule->second.attributes) {
    if (attribute.default_value.empty() || element.attribute(attribute.name) != nullptr) continue;
    element.attributes.push_back(
        {attribute.name, {}, attribute.default_value, element.span, element.span});
  }
  for (XmlElement& child : element.children) add_defaults(child, this->type(type, child.name));
}

}  // namespace dive::mission
