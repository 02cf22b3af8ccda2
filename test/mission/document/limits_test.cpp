// Files that are too large, files of other systems, and random files.

#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "mission/document/mission.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

const std::string kWindow = DIVE_SOURCE_DIR "/missions/window.xml";

std::string read(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

// Code of the only diagnostic with that text in place of the Window mission.
std::string only_code(std::string text) {
  Diagnostics diagnostics;
  EXPECT_FALSE(parse_mission(SourceText(kWindow, std::move(text)), diagnostics));
  return diagnostics.list().size() == 1 ? diagnostics.list()[0].code : "";
}

std::string repeated(const std::string& text, std::size_t bytes) {
  std::string result;
  while (result.size() < bytes) result += text;
  return result;
}

// The diagnostics of the same text as a file on the disk.
std::vector<Diagnostic> of_file(const std::string& name, const std::string& text) {
  const fs::path path = fs::path(::testing::TempDir()) / name;
  std::ofstream(path, std::ios::binary) << text;
  Diagnostics diagnostics;
  EXPECT_FALSE(load_mission(path.string(), diagnostics));
  fs::remove(path);
  return diagnostics.list();
}

TEST(MissionLimits, TenMegabytesOfNesting) {
  const std::string text = repeated("<state id='s'>", 10 << 20);
  EXPECT_EQ(only_code(text), "XML-SIZE");
  const std::vector<Diagnostic> found = of_file("dive_nesting.xml", text);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].code, "FILE-UNREADABLE");
  EXPECT_NE(found[0].message.find("larger than"), std::string::npos);
}

TEST(MissionLimits, TenMegabytesOfDescription) {
  const std::string text = "<mission xmlns='urn:dive:mission:1' id='m'><description>" +
                           repeated("deep ", 10 << 20) + "</description></mission>";
  EXPECT_EQ(only_code(text), "XML-SIZE");
  EXPECT_EQ(of_file("dive_description.xml", text).at(0).code, "FILE-UNREADABLE");
}

TEST(MissionLimits, NestingWithinTheSizeAllowed) {
  EXPECT_EQ(only_code(repeated("<state id='s'>", 1 << 20)).substr(0, 4), "XML-");
}

TEST(MissionLimits, ManyElementsWithinTheSizeAllowed) {
  EXPECT_EQ(only_code("<mission xmlns='urn:dive:mission:1' id='m'><states initial='a'>" +
                      repeated("<final id='a'/>", 900'000) + "</states></mission>"),
            "XML-COUNT");
}

// The maximum number of mistakes: each stage is bounded, and so is the report.
TEST(MissionLimits, ManyMistakes) {
  Diagnostics diagnostics;
  const std::string text = "<mission xmlns='urn:dive:mission:1' id='m'><states initial='a'>" +
                           repeated("<finl idd='a' x='NaN'/><goto z='INF'/>", 300'000) +
                           "</states></mission>";
  EXPECT_FALSE(parse_mission(SourceText(kWindow, text), diagnostics));
  EXPECT_EQ(diagnostics.list().size(), Diagnostics::kMaxDiagnostics);
}

TEST(MissionLimits, FilesThatAreNone) {
  for (const std::string path : {"/no/such/mission.xml", "/", "/dev/zero"}) {
    Diagnostics diagnostics;
    EXPECT_FALSE(load_mission(path, diagnostics));
    ASSERT_EQ(diagnostics.list().size(), 1U) << path;
    EXPECT_EQ(diagnostics.list()[0].code, "FILE-UNREADABLE");
    EXPECT_EQ(diagnostics.list()[0].file, path);
  }
}

// Missions of another vehicle, and regression files of XML parsers.
TEST(ForeignFiles, AreRefusedWithALocatedReason) {
  const fs::path data = fs::path(DIVE_SHARED_DATA);
  if (!fs::exists(data)) GTEST_SKIP() << "the shared data is not here: " << data;
  int refused = 0;
  for (const fs::path& folder : {data / "missions/acfr", data / "xml"}) {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      Diagnostics diagnostics;
      EXPECT_FALSE(load_mission(entry.path().string(), diagnostics)) << entry.path();
      ASSERT_FALSE(diagnostics.ok()) << entry.path();
      const Diagnostic& first = diagnostics.list().front();
      EXPECT_FALSE(first.message.empty()) << entry.path();
      // One file is in EBCDIC, in which an ASCII search does not find the tags.
      if (first.code != "FILE-UNREADABLE" && first.code != "XML-SCAN") {
        EXPECT_GT(first.span.line, 0) << entry.path();
      }
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

// One mistake at a random position in a valid mission: it is accepted, or rejected with errors that
// have a position.
RC_GTEST_PROP(MutatedMission, IsReadOrRefusedWithAPlace, ()) {
  static const std::string kGood = read(kWindow);
  std::string text = kGood;
  const int mutations = *rc::gen::inRange(1, 5);
  for (int i = 0; i < mutations; ++i) {
    const std::size_t at = *rc::gen::inRange<std::size_t>(0, text.size());
    const std::size_t length = *rc::gen::inRange<std::size_t>(0, 12);
    const std::string patch = *rc::gen::element<std::string>(
        "", "<", ">", "\"", "/", "=", "&lt;", "&", "NaN", "-1", "state", "goal", " id=\"gate\"",
        "<final id=\"f\"/>", "<!--", "-->", "\xff", "]]>", "<transition/>", " ");
    text.replace(at, length, patch);
  }
  Diagnostics diagnostics;
  const std::optional<Mission> mission = parse_mission(SourceText(kWindow, text), diagnostics);
  RC_ASSERT(mission.has_value() == diagnostics.ok());
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    RC_ASSERT(diagnostic.span.line > 0);
    RC_ASSERT(diagnostic.span.column > 0);
    RC_ASSERT(!diagnostic.message.empty());
  }
}

}  // namespace
}  // namespace dive::mission
