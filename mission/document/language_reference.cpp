#include "mission/document/language_reference.h"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace dive::mission {
namespace {

// One section: a type, and the elements that have it.
struct Section {
  std::string type;
  std::vector<const ChildRule*> elements;
  std::vector<std::string> places;  ///< Elements in which they stand.
};

void add_once(std::vector<std::string>& list, const std::string& word) {
  if (std::ranges::find(list, word) == list.end()) list.push_back(word);
}

// Adds an element, and the elements in it where its type is new or known by other names only.
void add(const Language& language, const ChildRule& element, const std::string& place,
         std::vector<Section>& sections) {
  const auto known = std::ranges::find(sections, element.type, &Section::type);
  const bool is_new = known == sections.end();
  if (is_new) sections.push_back({element.type, {}, {}});
  Section& section = is_new ? sections.back() : *known;
  if (!place.empty()) add_once(section.places, place);
  const auto is_named = [&](const ChildRule* other) { return other->name == element.name; };
  if (std::ranges::any_of(section.elements, is_named)) return;
  section.elements.push_back(&element);
  for (const ChildRule& child : language.type_rule(element.type).child_list) {
    add(language, child, element.name, sections);
  }
}

std::string anchor(const std::string& type) {
  std::string lower = type;
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return "element-" + lower;
}

// Text in a cell of a table: as it is, not as markup.
std::string cell(const std::string& text) {
  constexpr std::string_view kMarkup = "|*_";
  std::string result;
  for (const char c : text) {
    if (kMarkup.find(c) != std::string_view::npos) result += '\\';
    if (c == '<' || c == '&') {
      result += c == '<' ? "&lt;" : "&amp;";
    } else {
      result += c;
    }
  }
  return result;
}

// "a number from 0 to 100 (m)" to "number from 0 to 100" and "m"; what follows a comma in the
// brackets explains.
std::pair<std::string, std::string> value_and_unit(const AttributeRule& attribute) {
  std::string value = attribute.expected;
  std::string unit;
  const std::size_t bracket = value.rfind(" (");
  if (bracket != std::string::npos && value.back() == ')' && attribute.choices.empty()) {
    unit = value.substr(bracket + 2, value.size() - bracket - 3);
    value.erase(bracket);
    if (const std::size_t comma = unit.find(", "); comma != std::string::npos) {
      value += " (" + unit.substr(comma + 2) + ")";
      unit.erase(comma);
    }
    if (unit.find(':') != std::string::npos) value += " (" + std::exchange(unit, "") + ")";
  }
  if (!attribute.choices.empty()) value = fmt::format("{}", fmt::join(attribute.choices, ", "));
  for (const char* article : {"a ", "an "}) {
    if (value.starts_with(article)) value.erase(0, std::string(article).size());
  }
  return {value, unit};
}

std::string attribute_table(const ElementRule& rule) {
  if (rule.attributes.empty()) return "";
  std::string text = "| attribute | value | unit | if absent | meaning |\n|---|---|---|---|---|\n";
  for (const AttributeRule& attribute : rule.attributes) {
    const auto [value, unit] = value_and_unit(attribute);
    std::string absent = attribute.required ? "**required**" : "";
    if (!attribute.default_value.empty()) absent = "`" + attribute.default_value + "`";
    text += fmt::format("| `{}` | {} | {} | {} | {} |\n", attribute.name, cell(value), cell(unit),
                        absent, cell(attribute.documentation));
  }
  return text + "\n";
}

std::string times(const ChildRule& child) {
  if (child.is_required && child.max_count > 1) {
    return fmt::format("{} to {}", child.min_count, child.max_count);
  }
  if (child.may_repeat) return child.is_required ? "once or more" : "any number";
  return child.is_required ? "once" : "at most once";
}

std::string child_table(const ElementRule& rule) {
  if (rule.child_list.empty()) return "";
  std::string text = "| element in it | how often | meaning |\n|---|---|---|\n";
  for (const ChildRule& child : rule.child_list) {
    text += fmt::format("| [`{}`](#{}) | {} | {} |\n", child.name, anchor(child.type), times(child),
                        cell(child.documentation));
  }
  return text + "\n";
}

std::string section_text(const Language& language, const Section& section) {
  const ElementRule& rule = language.type_rule(section.type);
  std::vector<std::string> names;
  for (const ChildRule* element : section.elements) {
    names.push_back(fmt::format("`{}`", element->name));
  }
  std::string text =
      fmt::format("<a id=\"{}\"></a>\n## {}\n\n", anchor(section.type), fmt::join(names, ", "));
  if (!section.places.empty()) {
    text += fmt::format("In `{}`.\n\n", fmt::join(section.places, "`, `"));
  }
  for (const ChildRule* element : section.elements) {
    const bool is_one = section.elements.size() == 1;
    text += is_one ? cell(element->documentation) + "\n"
                   : fmt::format("- `{}`: {}\n", element->name, cell(element->documentation));
  }
  text += "\n";
  if (!rule.documentation.empty()) text += cell(rule.documentation) + "\n\n";
  if (!rule.text.empty()) text += fmt::format("Contains {}.\n\n", cell(rule.text));
  std::string examples;
  for (const ChildRule* element : section.elements) {
    if (!element->example.empty()) examples += element->example + "\n";
  }
  if (!examples.empty()) text += "```xml\n" + examples + "```\n\n";
  return text + attribute_table(rule) + child_table(rule);
}

constexpr const char* kIntroduction =
    "# The mission language\n\n"
    "<!-- Made from missions/mission.xsd by `dive generate`: change the schema, not this page. "
    "-->\n"
    "\n"
    "Every element and attribute of a mission file, in the order in which one meets them. This "
    "page "
    "is made from the\nschema `missions/mission.xsd`, by which `dive` checks every mission; "
    "[the tutorial](tutorial.md) is a better place to\nbegin.\n\n"
    "- Positions are metres in the world frame: `x` east, `y` north of the map's origin. `z_units` "
    "says what `z` means.\n"
    "- Headings are compass headings in degrees: 0 is north, 90 is east. Times are seconds, speeds "
    "metres per second.\n"
    "- Numbers have a decimal point and no exponent. Ids begin with a letter or `_`.\n"
    "- `dive check --rules` lists the rules that go beyond this page, such as that a target must "
    "exist.\n"
    "- **required**: the mission is refused without it. An empty place in *if absent*: the "
    "meaning says what applies.\n\n";

}  // namespace

std::string language_reference(const Language& language) {
  std::vector<Section> sections;
  for (const ChildRule& root : language.type_rule("").child_list) {
    add(language, root, "", sections);
  }
  std::string text = kIntroduction;
  for (const Section& section : sections) text += section_text(language, section);
  text.pop_back();  // the last of two line breaks
  return text;
}

}  // namespace dive::mission
