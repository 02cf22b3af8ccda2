#include "common/diagnostic.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "common/assert.h"
#include "common/suggest.h"

namespace dive {
namespace {

TEST(Render, PutsTheCaretUnderTheMistake) {
  const SourceText source("a.xml", "<a>\n  <goal z='deep'/>\n</a>\n");
  Diagnostics diagnostics;
  diagnostics.error("X-1", source, Span{2, 12, 4}, "'deep' is not a number", "write metres");
  EXPECT_EQ(render(diagnostics.list().at(0), false),
            "a.xml:2:12: error: 'deep' is not a number [X-1]\n"
            "    <goal z='deep'/>\n"
            "             ^~~~\n"
            "  hint: write metres\n");
}

TEST(Render, CountsCharactersNotBytesAndDefusesControlBytes) {
  const SourceText source("b.xml", "<é\x1b[2Jx bad/>");
  Diagnostics diagnostics;
  diagnostics.error("X-2", source, source.span_at(source.content().find("bad"), 3), "no");
  EXPECT_EQ(render(diagnostics.list().at(0), false),
            "b.xml:1:10: error: no [X-2]\n"
            "  <é?[2Jx bad/>\n"
            "          ^~~\n");
}

TEST(Render, CutsLongLinesAroundTheCaret) {
  std::string content(200'000, 'a');
  content.replace(100'000, 3, "BAD");
  const SourceText source("c.xml", content);
  Diagnostics diagnostics;
  diagnostics.error("X-3", source, Span{1, 100'001, 3}, "no");
  const std::string text = render(diagnostics.list().at(0), false);
  EXPECT_LT(text.size(), 400U);
  const std::size_t line = text.find("\n  ") + 1;
  const std::size_t caret = text.find('^');
  const std::size_t caret_line = text.rfind('\n', caret) + 1;
  EXPECT_EQ(text.substr(line + (caret - caret_line), 3), "BAD");
}

TEST(Diagnostics, AreBoundedButCounted) {
  Diagnostics diagnostics;
  for (int i = 0; i < 1000; ++i) diagnostics.add(Diagnostic{});
  EXPECT_EQ(diagnostics.list().size(), Diagnostics::kMaxDiagnostics);
  EXPECT_EQ(diagnostics.error_count(), 1000U);
  EXPECT_FALSE(diagnostics.ok());
}

TEST(SourceText, AcceptsEveryLineBreak) {
  const SourceText source("d", "one\r\ntwo\nthree");
  EXPECT_EQ(source.line(1), "one");
  EXPECT_EQ(source.line(2), "two");
  EXPECT_EQ(source.line(3), "three");
  EXPECT_EQ(source.line(4), "");
  EXPECT_EQ(source.span_at(5, 1).line, 2);
  EXPECT_EQ(source.span_at(6, 1).column, 2);
}

TEST(ReadSourceText, ReportsWhyAFileCannotBeRead) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "source_text";
  fs::create_directories(folder);
  EXPECT_EQ(read_source_text((folder / "none.xml").string(), 10).error(), "no such file");
  EXPECT_EQ(read_source_text(folder.string(), 10).error(), "is a directory");
  EXPECT_EQ(read_source_text("/dev/zero", 10).error(), "is a device, not a regular file");
  std::ofstream(folder / "big.xml") << std::string(3000, 'x');
  EXPECT_EQ(read_source_text((folder / "big.xml").string(), 2048).error(), "is larger than 2 KiB");
  EXPECT_EQ(read_source_text((folder / "big.xml").string(), 3000)->content().size(), 3000U);
}

TEST(ClosestMatch, FindsWhatWasMeantAndNothingFarFetched) {
  const std::vector<std::string> names{"goto", "goal_sequence", "hold", "surface"};
  EXPECT_EQ(closest_match("goal_sequnce", names), "goal_sequence");
  EXPECT_EQ(closest_match("surafce", names), "surface");
  EXPECT_EQ(closest_match("hodl", names), "hold");
  EXPECT_EQ(closest_match("transect", names), std::nullopt);
  EXPECT_EQ(closest_match("", names), std::nullopt);
  EXPECT_EQ(closest_match(std::string(1'000'000, 'a'), names), std::nullopt);
}

TEST(Demand, ThrowsWithThePlace) {
  try {
    DIVE_DEMAND(1 + 1 == 3);
    FAIL();
  } catch (const AssertionFailure& failure) {
    EXPECT_NE(std::string(failure.what()).find("diagnostic_test.cpp"), std::string::npos);
    EXPECT_NE(std::string(failure.what()).find("1 + 1 == 3"), std::string::npos);
  }
}

}  // namespace
}  // namespace dive
