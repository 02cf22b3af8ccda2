// Positions of editors, and where a cursor stands in XML that is being typed.
#include <algorithm>
#include <string>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "mission/language_server/text_position.h"
#include "mission/language_server/xml_cursor.h"

namespace dive::mission {
namespace {

TEST(TextPosition, CountsUtf16CodeUnits) {
  // a, e with acute accent, euro sign, a diver's flag outside of the basic plane
  const std::string text = "x\na\xC3\xA9\xE2\x82\xAC\xF0\x9F\x9A\xA9z\r\nlast";
  EXPECT_EQ(utf16_length("a\xC3\xA9\xE2\x82\xAC\xF0\x9F\x9A\xA9z"), 6);
  EXPECT_EQ(text[offset_of(text, {1, 5})], 'z');
  EXPECT_EQ(text[offset_of(text, {1, 99})], '\r');
  EXPECT_EQ(offset_of(text, {99, 0}), text.size());
  const EditorRange range = range_of({2, 11, 1}, "a\xC3\xA9\xE2\x82\xAC\xF0\x9F\x9A\xA9z");
  EXPECT_EQ(range.start.line, 1);
  EXPECT_EQ(range.start.character, 5);
  EXPECT_EQ(range.end.character, 6);
}

RC_GTEST_PROP(TextPosition, UriAndPathAreInverse, (const std::string& name)) {
  const std::string path = "/" + name;
  RC_ASSERT(path_of_uri(uri_of_path(path)) == path);
}

TEST(TextPosition, HasNoPathOfOtherSchemes) {
  EXPECT_EQ(path_of_uri("untitled:one"), "");
  EXPECT_EQ(path_of_uri("file:///a%20b%2"), "/a b%2");
}

std::string innermost(const XmlCursor& cursor) {
  return cursor.elements.empty() ? "" : cursor.elements.back().name;
}

TEST(XmlCursorTest, KnowsItsPlace) {
  const std::string text = "<a x='1'><!-- <b> --><c y=\"2\" z='>'/><d>t</d><e ";
  const auto at = [&](const char* mark) {
    return xml_cursor(text, text.find(mark) + std::string(mark).size());
  };
  EXPECT_EQ(at("<a").place, CursorPlace::kElementName);
  EXPECT_EQ(at("<a x='1").place, CursorPlace::kAttributeValue);
  EXPECT_EQ(at("<a x='1").attribute, "x");
  EXPECT_EQ(at("<!-- <b").place, CursorPlace::kElsewhere);
  EXPECT_EQ(innermost(at("<d>t")), "d");
  EXPECT_EQ(innermost(at("</d>")), "a");
  EXPECT_EQ(at("<e ").place, CursorPlace::kTag);
  EXPECT_EQ(innermost(at("<c y")), "c");
  EXPECT_EQ(at("<c y").elements.back().value("y"), "2");
}

// Whatever is typed, the scan ends, within the text.
RC_GTEST_PROP(XmlCursorTest, ReadsAnyText, ()) {
  const auto text =
      *rc::gen::container<std::string>(rc::gen::elementOf(std::string("<>/='\"!-? ab\n")));
  const auto at = *rc::gen::inRange<std::size_t>(0, text.size() + 2);
  const XmlCursor cursor = xml_cursor(text, at);
  RC_ASSERT(cursor.begin <= std::min(at, text.size()));
  if (cursor.place != CursorPlace::kContent && cursor.place != CursorPlace::kElsewhere) {
    RC_ASSERT(!cursor.elements.empty());
  }
}

}  // namespace
}  // namespace dive::mission
