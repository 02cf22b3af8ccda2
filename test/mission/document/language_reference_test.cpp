// The reference made from a schema, and the examples in ours.
#include "mission/document/language_reference.h"

#include <algorithm>
#include <set>
#include <sstream>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "behaviors/failsafes.h"
#include "common/xml.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

constexpr const char* kSchema = R"(<?xml version="1.0"?>
<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" xmlns="urn:t" targetNamespace="urn:t">
  <xs:element name="buoy" type="Buoy">
    <xs:annotation><xs:documentation>A buoy | mark.</xs:documentation>
      <xs:appinfo>&lt;buoy depth="3"/&gt;</xs:appinfo></xs:annotation>
  </xs:element>
  <xs:complexType name="Buoy">
    <xs:sequence>
      <xs:element name="lamp" type="Lamp" minOccurs="0" maxOccurs="unbounded">
        <xs:annotation><xs:documentation>Its
          lamp.</xs:documentation></xs:annotation>
      </xs:element>
    </xs:sequence>
    <xs:attribute name="depth" type="Depth" use="required">
      <xs:annotation><xs:documentation>Of the anchor.</xs:documentation></xs:annotation>
    </xs:attribute>
    <xs:attribute name="colour" type="Colour" default="red"/>
  </xs:complexType>
  <xs:complexType name="Lamp"/>
  <xs:simpleType name="Depth">
    <xs:annotation><xs:appinfo>a number from 0 to 200 (m)</xs:appinfo></xs:annotation>
    <xs:restriction base="xs:decimal"/>
  </xs:simpleType>
  <xs:simpleType name="Colour">
    <xs:restriction base="xs:token">
      <xs:enumeration value="red"/><xs:enumeration value="green"/>
    </xs:restriction>
  </xs:simpleType>
</xs:schema>)";

TEST(LanguageReference, StatesValueUnitDefaultAndChildren) {
  const Language language({"t.xsd", kSchema, "buoy", "urn:t"});
  const std::string page = language_reference(language);
  EXPECT_THAT(page,
              HasSubstr("## `buoy`\n\nA buoy \\| mark.\n\n```xml\n<buoy depth=\"3\"/>\n```\n"));
  EXPECT_THAT(page,
              HasSubstr("| `depth` | number from 0 to 200 | m | **required** | Of the anchor. |"));
  EXPECT_THAT(page, HasSubstr("| `colour` | red, green |  | `red` |  |"));
  EXPECT_THAT(page, HasSubstr("| [`lamp`](#element-lamp) | any number | Its lamp. |"));
  EXPECT_THAT(page, HasSubstr("<a id=\"element-lamp\"></a>\n## `lamp`\n\nIn `buoy`.\n\n"));
}

TEST(LanguageReference, ElementsOfASharedTypeStandWhereverItDoes) {
  constexpr const char* kShared = R"(<?xml version="1.0"?>
<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" xmlns="urn:t" targetNamespace="urn:t">
  <xs:element name="buoy" type="Buoy"/>
  <xs:complexType name="Buoy">
    <xs:sequence>
      <xs:element name="top" type="Mark" minOccurs="0"/>
      <xs:element name="bottom" type="Mark" minOccurs="0"/>
    </xs:sequence>
  </xs:complexType>
  <xs:complexType name="Mark">
    <xs:sequence>
      <xs:element name="lamp" type="Lamp" minOccurs="0"/>
    </xs:sequence>
  </xs:complexType>
  <xs:complexType name="Lamp"/>
</xs:schema>)";
  const std::string page = language_reference(Language({"t.xsd", kShared, "buoy", "urn:t"}));
  EXPECT_THAT(page, HasSubstr("## `top`, `bottom`\n\nIn `buoy`.\n"));
  EXPECT_THAT(page, HasSubstr("## `lamp`\n\nIn `top`, `bottom`.\n"));
}

// Every element and attribute of the example may stand there, and all required ones do.
void expect_valid(const Language& language, const XmlElement& element, const std::string& type) {
  const ElementRule& rule = language.type_rule(type);
  for (const XmlAttribute& attribute : element.attributes) {
    const AttributeRule* known = rule.attribute(attribute.name);
    ASSERT_NE(known, nullptr) << element.name << " has no attribute " << attribute.name;
    if (!known->choices.empty()) {
      EXPECT_THAT(known->choices, ::testing::Contains(attribute.value)) << attribute.name;
    }
  }
  for (const AttributeRule& attribute : rule.attributes) {
    if (!attribute.required) continue;
    EXPECT_NE(element.attribute(attribute.name), nullptr) << element.name << ": " << attribute.name;
  }
  for (const XmlElement& child : element.children) {
    const std::string inner = language.type(type, child.name);
    ASSERT_FALSE(inner.empty()) << child.name << " in " << element.name;
    expect_valid(language, child, inner);
  }
}

int expect_valid_examples(const Language& language, const std::string& type,
                          std::set<std::string>& seen) {
  int examples = 0;
  if (!seen.insert(type).second) return examples;
  for (const ChildRule& child : language.type_rule(type).child_list) {
    if (!child.example.empty()) {
      ++examples;
      Diagnostics diagnostics;
      const auto parsed =
          parse_xml(SourceText(child.name, child.example), XmlLimits{}, diagnostics);
      EXPECT_TRUE(parsed) << child.example;
      if (parsed) {
        EXPECT_EQ(parsed->root.name, child.name);
        expect_valid(language, parsed->root, child.type);
      }
    }
    examples += expect_valid_examples(language, child.type, seen);
  }
  return examples;
}

TEST(LanguageReference, ExamplesOfTheMissionLanguageAreValid) {
  std::set<std::string> seen;
  EXPECT_GT(expect_valid_examples(Language(mission_schema()), "", seen), 40);
}

TEST(LanguageReference, EveryAttributeOfTheMissionLanguageIsExplained) {
  const std::string page = language_reference(Language(mission_schema()));
  EXPECT_EQ(page.find("|  |\n"), std::string::npos) << "an empty meaning";
}

// The value for `name` where the text ends with "Absent: 60." or "Absent: leak 1, the others 0."
std::string stated_default(const std::string& text, std::string_view name) {
  constexpr std::string_view kBegin = "Absent: ";
  const std::size_t begin = text.rfind(kBegin);
  if (begin == std::string::npos || text.back() != '.') return {};
  const std::size_t at = begin + kBegin.size();
  std::istringstream list(text.substr(at, text.size() - 1 - at));
  std::string value_of_others;
  for (std::string entry; std::getline(list >> std::ws, entry, ',');) {
    const std::size_t blank = entry.rfind(' ');
    const std::string of = blank == std::string::npos ? "the others" : entry.substr(0, blank);
    const std::string value = blank == std::string::npos ? entry : entry.substr(blank + 1);
    if (of == name) return value;
    if (of == "the others") value_of_others = value;
  }
  return value_of_others;
}

TEST(MissionSchema, StatesTheDefaultsOfEveryFailsafe) {
  const Language language(mission_schema());
  for (std::size_t i = 0; i < behaviors::kFailsafeCount; ++i) {
    const auto& traits = behaviors::traits(static_cast<behaviors::FailsafeKind>(i));
    if (!traits.in_missions) continue;
    const ElementRule* rule = language.rule("Failsafes", traits.name);
    ASSERT_NE(rule, nullptr) << traits.name;
    const auto expect = [&](std::string_view attribute, double value) {
      EXPECT_EQ(stated_default(rule->attribute(attribute)->documentation, traits.name),
                fmt::format("{:g}", value))
          << traits.name << " " << attribute;
    };
    expect("persistence", traits.policy.persistence_s);
    expect("clear", traits.policy.clear_s);
    const bool is_own = traits.kind != behaviors::FailsafeKind::kBattery;  // or of the limits
    if (!traits.threshold_name.empty() && is_own) expect(traits.threshold_name, traits.threshold);
  }
}

}  // namespace
}  // namespace dive::mission
