#include "mission/document/schema_words.h"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

#include "common/suggest.h"
#include "mission/document/source_place.h"

namespace dive::mission {
namespace {

constexpr std::size_t kMaxQuoted = 40;

// A value for quoting in a sentence: shortened, and never cut inside a character.
std::string in_quotes(std::string_view value) {
  if (value.size() <= kMaxQuoted) return fmt::format("'{}'", value);
  std::size_t end = kMaxQuoted;
  while (end > 0 && (static_cast<unsigned char>(value[end]) & 0xC0U) == 0x80U) --end;
  return fmt::format("'{}...'", value.substr(0, end));
}

// Frequent number formats that the parser does not accept.
std::string hint_for_number(std::string_view value, std::string_view expected) {
  if (expected.find("number") == std::string_view::npos) return {};
  if (value.find(',') != std::string_view::npos) return "write a decimal point, not a comma";
  const std::size_t end = value.find_first_not_of("+-.0123456789 ");
  if (end == std::string_view::npos || end == 0) return {};
  const bool exponent = value[end] == 'e' || value[end] == 'E';
  return exponent ? "write the number without an exponent" : "write the number without its unit";
}

std::ptrdiff_t count_of(const XmlElement& parent, const std::string& name) {
  return std::ranges::count(parent.children, name, &XmlElement::name);
}

std::string hint_for_root(const XmlElement& root, const SchemaSource& schema) {
  if (root.name == "mission" && root.namespace_uri.empty() && root.child("primitive") != nullptr) {
    return "this is a mission of ACFR's vehicles: convert it with dive import acfr";
  }
  if (root.name != schema.root) {
    if (root.name == "sdf") return "this is a map: a mission names it, <map file=\"...\"/>";
    if (root.name == "scenario") return "this is a scenario: dive test runs it";
    if (root.name == "mission") return "this is a mission: dive check, plan and run read it";
    if (root.name == "fragment") return "this is a fragment: check the mission that includes it";
  }
  return fmt::format("begin with <{} xmlns=\"{}\">", schema.root, schema.namespace_uri);
}

}  // namespace

void SchemaWords::wrong_root(const XmlElement& root) {
  const SchemaSource& schema = language_.source();
  const std::string hint = hint_for_root(root, schema);
  if (root.name != schema.root) {
    diagnostics_.error("XSD-ROOT", source_, root.span,
                       fmt::format("this is not a {0}: the root element is '{1}', not '{0}'",
                                   schema.root, root.name),
                       hint);
  } else if (root.namespace_uri.empty()) {
    diagnostics_.error("XSD-ROOT", source_, root.span,
                       fmt::format("the {} names no namespace", schema.root), hint);
  } else {
    const std::size_t written =
        source_.content().find(root.namespace_uri, offset_of(source_, root.span));
    diagnostics_.error("XSD-ROOT", source_,
                       written == std::string::npos
                           ? root.span
                           : source_.span_at(written, root.namespace_uri.size()),
                       fmt::format("the namespace is {}, not '{}'", in_quotes(root.namespace_uri),
                                   schema.namespace_uri),
                       hint);
  }
}

std::optional<std::string> SchemaWords::unknown_element(const XmlElement& element,
                                                        const XmlElement& parent,
                                                        const std::string& parent_type) {
  const std::vector<std::string> allowed = language_.type_rule(parent_type).child_names();
  std::string message =
      fmt::format("'{}' is not an element that may stand in '{}'", element.name, parent.name);
  message += allowed.empty() ? ": nothing may" : fmt::format(": {} may", fmt::join(allowed, ", "));
  std::optional<std::string> meant;
  std::string hint;
  const std::vector<std::string> homes = language_.parents_of(element.name);
  if (element.namespace_uri != language_.source().namespace_uri) {
    hint = fmt::format("it is not in the namespace {}", language_.source().namespace_uri);
  } else if (!homes.empty()) {
    hint = fmt::format("'{}' belongs in {}", element.name, fmt::join(homes, ", "));
  } else {
    meant = closest_match(element.name, allowed);
    if (meant) hint = fmt::format("did you mean '{}'?", *meant);
  }
  diagnostics_.error("XSD-ELEMENT", source_, element.span, std::move(message), std::move(hint));
  return meant;
}

void SchemaWords::misplaced_element(const XmlElement& element, const XmlElement& parent,
                                    const std::string& parent_type,
                                    const std::vector<std::string>& expected) {
  const ChildRule* rule = language_.type_rule(parent_type).child(element.name);
  const std::ptrdiff_t count = count_of(parent, element.name);
  if (rule != nullptr && rule->max_count > 1 && count > rule->max_count) {
    diagnostics_.error("XSD-ELEMENT", source_, element.span,
                       fmt::format("'{}' may have at most {} elements '{}', and has {}",
                                   parent.name, rule->max_count, element.name, count));
    return;
  }
  const auto same = [&element](const XmlElement& other) { return other.name == element.name; };
  const auto first = std::find_if(parent.children.begin(), parent.children.end(), same);
  const bool repeated = first != parent.children.end() && &*first != &element;
  std::string hint;
  if (repeated) {
    hint = fmt::format("the first is in {}", source_.line_name(first->span.line));
  } else if (!expected.empty()) {
    hint = fmt::format("here may stand {}", fmt::join(expected, ", "));
  }
  diagnostics_.error(
      "XSD-ELEMENT", source_, element.span,
      repeated && parent.name != "goal_sequence"
          ? fmt::format("'{}' stands more than once in '{}'", element.name, parent.name)
          : fmt::format("'{}' may stand in '{}', but not here", element.name, parent.name),
      std::move(hint));
}

void SchemaWords::missing_children(const XmlElement& element, const std::string& type,
                                   const std::vector<std::string>& expected) {
  const auto needs = [&](const std::string& what) {
    diagnostics_.error("XSD-MISSING-ELEMENT", source_, element.span,
                       fmt::format("'{}' needs {}", element.name, what));
  };
  const auto needs_child = [&](const std::string& name) {
    const ChildRule* child = language_.type_rule(type).child(name);
    const int least = child == nullptr ? 1 : child->min_count;
    needs(least <= 1 ? fmt::format("an element '{}'", name)
                     : fmt::format("at least {} elements '{}', and has {}", least, name,
                                   count_of(element, name)));
  };
  const std::vector<std::string>& required = language_.type_rule(type).required_children;
  if (!required.empty()) {
    // libxml2 lists ten of the elements that may come next, and no more.
    const auto is_listed = [&](const std::string& name) {
      return std::find(expected.begin(), expected.end(), name) != expected.end();
    };
    const bool any_listed = std::any_of(required.begin(), required.end(), is_listed);
    for (const std::string& name : required) {
      if (any_listed ? is_listed(name) : element.child(name) == nullptr) {
        needs_child(name);
      }
    }
  } else if (const auto& one_of = language_.type_rule(type).one_of; !one_of.empty()) {
    needs(fmt::format("at least one of {}", fmt::join(one_of, ", ")));
  } else if (expected.size() == 1) {
    needs_child(expected.front());
  } else {
    needs(fmt::format("at least one of {}", fmt::join(expected, ", ")));
  }
}

void SchemaWords::unknown_attribute(const XmlElement& element, const std::string& type,
                                    const std::string& name) {
  const auto named = [&name](const XmlAttribute& attribute) { return attribute.name == name; };
  const auto written = std::find_if(element.attributes.begin(), element.attributes.end(), named);
  const std::vector<std::string> allowed = language_.type_rule(type).attribute_names();
  std::string message = fmt::format("'{}' has no attribute '{}'", element.name, name);
  message +=
      allowed.empty() ? "; it has none" : fmt::format("; it has {}", fmt::join(allowed, ", "));
  diagnostics_.error("XSD-ATTRIBUTE", source_,
                     written == element.attributes.end() ? element.span : written->name_span,
                     std::move(message), did_you_mean(name, allowed));
}

void SchemaWords::missing_attribute(const XmlElement& element, const std::string& type,
                                    const std::string& name) {
  const ElementRule& rule = language_.type_rule(type);
  for (const XmlAttribute& written : element.attributes) {
    if (rule.attribute(written.name) != nullptr) continue;
    if (closest_match(written.name, rule.attribute_names()) == name) return;
  }
  const AttributeRule* attribute = rule.attribute(name);
  diagnostics_.error(
      "XSD-MISSING-ATTRIBUTE", source_, element.span,
      fmt::format("'{}' needs the attribute '{}'", element.name, name),
      attribute == nullptr ? "" : fmt::format("{} is {}", name, attribute->expected));
}

void SchemaWords::bad_value(const XmlElement& element, const std::string& type,
                            const std::string& attribute, const std::string& reason) {
  const ElementRule& element_rule = language_.type_rule(type);
  const XmlAttribute* written = element.attribute(attribute);
  const AttributeRule* rule = element_rule.attribute(attribute);
  if (written == nullptr || rule == nullptr) {
    diagnostics_.error("XSD-VALUE", source_, element.span,
                       element_rule.text.empty()
                           ? reason
                           : fmt::format("'{}' must be {}", element.name, element_rule.text));
    return;
  }
  std::string hint = did_you_mean(written->value, rule->choices);
  if (hint.empty()) hint = hint_for_number(written->value, rule->expected);
  diagnostics_.error(
      "XSD-VALUE", source_, written->value_span,
      fmt::format("{} is {}, but must be {}", attribute, in_quotes(written->value), rule->expected),
      std::move(hint));
}

void SchemaWords::stray_text(const XmlElement& element) {
  diagnostics_.error("XSD-TEXT", source_, place_of_text(source_, element),
                     fmt::format("text may not stand in '{}'", element.name),
                     "put notes into <!-- a comment --> or into 'description'");
}

}  // namespace dive::mission
