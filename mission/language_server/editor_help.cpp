#include "mission/language_server/editor_help.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

namespace dive::mission {
namespace {

// The type of the innermost of the first `count` elements; nothing for an unknown one. The type of
// the document itself is empty.
std::optional<std::string> type_of(const XmlCursor& cursor, std::size_t count,
                                   const Language& language) {
  std::string type;
  for (std::size_t i = 0; i < count; ++i) {
    type = language.type(type, cursor.elements[i].name);
    if (type.empty()) return std::nullopt;
  }
  return type;
}

std::vector<Completion> element_completions(const ElementRule& rule, bool has_bracket) {
  std::vector<Completion> result;
  for (const ChildRule& child : rule.child_list) {
    const bool is_known = std::ranges::any_of(
        result, [&](const Completion& other) { return other.label == child.name; });
    if (is_known) continue;
    result.push_back({CompletionKind::kElement, child.name, (has_bracket ? "" : "<") + child.name,
                      child.example, child.documentation, child.is_required});
  }
  return result;
}

std::vector<Completion> attribute_completions(const ElementRule& rule, const XmlCursor& cursor) {
  std::vector<Completion> result;
  for (const AttributeRule& attribute : rule.attributes) {
    const auto is_written = [&](const auto& written) { return written.first == attribute.name; };
    const bool is_there = std::ranges::any_of(cursor.elements.back().attributes, is_written);
    if (is_there && attribute.name != cursor.attribute) continue;
    result.push_back({CompletionKind::kAttribute, attribute.name,
                      is_there ? attribute.name : attribute.name + "=\"\"", attribute.expected,
                      attribute.documentation, attribute.required});
  }
  return result;
}

std::vector<Completion> value_completions(const AttributeRule& attribute) {
  std::vector<Completion> result;
  for (const std::string& choice : attribute.choices) {
    const char* detail = choice == attribute.default_value ? "default" : "";
    result.push_back({CompletionKind::kValue, choice, choice, detail, attribute.documentation});
  }
  return result;
}

}  // namespace

std::vector<Completion> completions(const XmlCursor& cursor, const Language& language) {
  const bool is_name = cursor.place == CursorPlace::kElementName;
  const std::size_t around = cursor.elements.size() - (is_name ? 1 : 0);
  const std::optional<std::string> type = type_of(cursor, around, language);
  if (!type) return {};
  const ElementRule& rule = language.type_rule(*type);
  switch (cursor.place) {
    case CursorPlace::kContent:
      return element_completions(rule, false);
    case CursorPlace::kElementName:
      return element_completions(rule, true);
    case CursorPlace::kTag:
      return attribute_completions(rule, cursor);
    case CursorPlace::kAttributeValue: {
      const AttributeRule* attribute = rule.attribute(cursor.attribute);
      return attribute == nullptr ? std::vector<Completion>{} : value_completions(*attribute);
    }
    case CursorPlace::kElsewhere:
      break;
  }
  return {};
}

std::string meaning(const XmlCursor& cursor, const Language& language) {
  if (cursor.elements.empty() || cursor.place == CursorPlace::kElsewhere) return {};
  const auto outer = type_of(cursor, cursor.elements.size() - 1, language);
  if (!outer) return {};
  const std::string& name = cursor.elements.back().name;
  const ElementRule* rule = language.rule(*outer, name);
  const AttributeRule* attribute = rule == nullptr ? nullptr : rule->attribute(cursor.attribute);
  if (attribute != nullptr) {
    return fmt::format("`{}`: {}\n\n{}", attribute->name, attribute->expected,
                       attribute->documentation);
  }
  for (const ChildRule& child : language.type_rule(*outer).child_list) {
    if (child.name == name) return fmt::format("`{}`: {}", name, child.documentation);
  }
  return {};
}

}  // namespace dive::mission
