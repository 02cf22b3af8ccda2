#include "common/xml.h"

#include <filesystem>

#include <gtest/gtest.h>

namespace dive {
namespace {

std::optional<XmlDocument> parse(const std::string& text, Diagnostics& diagnostics,
                                 XmlLimits limits = {}) {
  return parse_xml(SourceText("t.xml", text), limits, diagnostics);
}

// Code and line of the single diagnostic.
std::pair<std::string, int> only_error(const std::string& text, XmlLimits limits = {}) {
  Diagnostics diagnostics;
  EXPECT_FALSE(parse(text, diagnostics, limits)) << text.substr(0, 200);
  if (diagnostics.list().size() != 1) return {"", -1};
  return {diagnostics.list()[0].code, diagnostics.list()[0].span.line};
}

using CodeAtLine = std::pair<std::string, int>;

TEST(ParseXml, RecordsThePlaceOfEveryNameAndValue) {
  Diagnostics diagnostics;
  const auto document = parse(
      "<?xml version='1.0'?>\n"
      "<!-- <decoy x='1'/> -->\n"
      "<m xmlns='urn:a' xmlns:b='urn:b'>\n"
      "  <![CDATA[ <decoy/> ]]>\n"
      "  <goal x = '1>2' b:y=\"&lt;3\"\n"
      "        z='7'/>text\n"
      "</m>\n",
      diagnostics);
  ASSERT_TRUE(document) << render(diagnostics.list().at(0), false);
  ASSERT_EQ(document->root.children.size(), 1U);
  const XmlElement& goal = document->root.children[0];
  EXPECT_EQ(goal.namespace_uri, "urn:a");
  EXPECT_EQ(goal.span.line, 5);
  EXPECT_EQ(goal.span.column, 4);
  ASSERT_NE(goal.attribute("x"), nullptr);
  EXPECT_EQ(goal.attribute("x")->value, "1>2");
  EXPECT_EQ(goal.attribute("x")->value_span.column, 14);
  EXPECT_EQ(goal.attribute("y"), nullptr) << "a prefixed attribute is another attribute";
  EXPECT_EQ(goal.attributes[1].value, "<3");
  EXPECT_EQ(goal.attributes[1].value_span.length, 5);
  EXPECT_EQ(goal.attribute("z")->name_span.line, 6);
  EXPECT_EQ(goal.attribute("z")->name_span.column, 9);
  EXPECT_EQ(document->root.text, "<decoy/> \n  text");
}

TEST(ParseXml, RefusesWhatIsDangerous) {
  EXPECT_EQ(only_error("<?xml version='1.0'?>\n<!DOCTYPE a [<!ENTITY b 'c'>]>\n<a>&b;</a>"),
            CodeAtLine("XML-DOCTYPE", 2));
  EXPECT_EQ(only_error("<a/>\n<!DOCTYPE a>"), CodeAtLine("XML-DOCTYPE", 2));
  EXPECT_EQ(only_error("\n<a>&undefined;</a>"), CodeAtLine("XML-SYNTAX", 2));
  EXPECT_EQ(only_error(std::string("<a\0/>", 5)), CodeAtLine("XML-ENCODING", 1));
  EXPECT_EQ(only_error("<?xml version='1.0' encoding='UTF-16'?><a/>"),
            CodeAtLine("XML-ENCODING", 1));
}

TEST(ParseXml, IsBounded) {
  std::string nested;
  for (int i = 0; i < 60; ++i) nested += "<a>\n";
  for (int i = 0; i < 60; ++i) nested += "</a>";
  EXPECT_EQ(only_error(nested), CodeAtLine("XML-DEPTH", 49));
  XmlLimits few;
  few.max_elements = 3;
  EXPECT_EQ(only_error("<a>\n<b/>\n<b/>\n<b/></a>", few), CodeAtLine("XML-COUNT", 4));

  std::string wide = "<a>\n<b";
  for (int i = 0; i < 50'000; ++i) wide += " a" + std::to_string(i) + "=''";
  EXPECT_EQ(only_error(wide + "/></a>"), CodeAtLine("XML-COUNT", 2));
  XmlLimits small;
  small.max_bytes = 100;
  EXPECT_EQ(only_error(std::string(101, ' '), small), CodeAtLine("XML-SIZE", 1));
  // Deeper than libxml2 itself allows: libxml2 must refuse it before our recursion overflows the
  // stack.
  EXPECT_EQ(only_error([] {
              std::string text;
              for (int i = 0; i < 200'000; ++i) text += "<a>";
              return text;
            }())
                .first,
            "XML-SYNTAX");
}

TEST(ParseXml, ReportsThePlaceOfASyntaxError) {
  EXPECT_EQ(only_error(""), CodeAtLine("XML-SYNTAX", 1));
  EXPECT_EQ(only_error("just text"), CodeAtLine("XML-SYNTAX", 1));
  EXPECT_EQ(only_error("<a>\n<b>\n</a>"), CodeAtLine("XML-SYNTAX", 3));
  EXPECT_EQ(only_error("<a>\n<b x='1' x='2'/></a>"), CodeAtLine("XML-SYNTAX", 2));
  EXPECT_EQ(only_error("<a>\n\xff\xfe</a>"), CodeAtLine("XML-SYNTAX", 2));
}

TEST(ParseNumber, AcceptsDecimalsOnly) {
  EXPECT_DOUBLE_EQ(*parse_number(" -1.5e-3 "), -1.5e-3);
  EXPECT_DOUBLE_EQ(*parse_number("+2"), 2.0);
  for (const char* bad :
       {"", " ", "NaN", "inf", "-INF", "1e999", "0x10", "1,5", "1 2", "+-1", "1m"}) {
    EXPECT_EQ(parse_number(bad), std::nullopt) << bad;
  }
  EXPECT_EQ(parse_numbers(" 1 2\n3 ", 3)->at(2), 3.0);
  EXPECT_EQ(parse_numbers("1 2", 3), std::nullopt);
  EXPECT_EQ(parse_numbers("1 2 3 4", 3), std::nullopt);
}

// Regression files of other XML parsers: none may crash, and each is read or rejected with a
// reason.
TEST(ParseXml, SurvivesTheTortureFiles) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(DIVE_SHARED_DATA) / "xml";
  if (!fs::exists(folder)) GTEST_SKIP() << "the shared data is not here: " << folder;
  int read = 0;
  int refused = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    Diagnostics diagnostics;
    if (read_xml(entry.path().string(), XmlLimits{}, diagnostics)) {
      ++read;
      EXPECT_TRUE(diagnostics.ok()) << entry.path();
    } else {
      ++refused;
      EXPECT_FALSE(diagnostics.ok()) << entry.path();
    }
  }
  EXPECT_GT(read, 20);
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace dive
