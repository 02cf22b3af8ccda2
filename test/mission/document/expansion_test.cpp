// Includes and parameters: the same mission as if written in full, every line traced to its source,
// and bounded growth.

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "mission/document/mission.h"
#include "mission/document/state_index.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

const std::string kMissions = DIVE_SOURCE_DIR "/missions/";
const std::string kAccepted = DIVE_SOURCE_DIR "/test/mission/accepted/";

std::string rendered(const Diagnostics& diagnostics) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics.list()) text += render(diagnostic, false);
  return text;
}

std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream stream(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

Mission loaded(const std::string& path) {
  Diagnostics diagnostics;
  std::optional<Mission> mission = load_mission(path, diagnostics);
  if (!mission) throw std::runtime_error(rendered(diagnostics));
  return std::move(*mission);
}

TEST(Expansion, MakesTheStatesThatWouldHaveBeenWritten) {
  const Mission mission = loaded(kMissions + "blocks.xml");
  ASSERT_EQ(mission.states.size(), 4U);
  const StateSpec& east = mission.states[1];
  EXPECT_EQ(east.id.value, "east");
  ASSERT_EQ(east.children.size(), 2U);
  const Goal& corner = *goals_of(east.children[0]).at(0);
  EXPECT_EQ(corner.position.x.value, 11.0);
  EXPECT_EQ(corner.position.z.value, 3.5) << "a parameter of the mission, handed on";
  EXPECT_EQ(east.children[0].timeout->on_timeout.value, "ascend");
  EXPECT_EQ(mission.states[0].children[0].timeout->on_timeout.value, "east");
  EXPECT_EQ(mission.failsafes
                .threshold[static_cast<std::size_t>(behaviors::FailsafeKind::kLocalisationLost)],
            1.5)
      << "a default of the fragment";
}

TEST(Expansion, FillsInReferencesQuotesAndParametersOfParameters) {
  const Mission mission = loaded(kAccepted + "included.xml");
  const StateSpec& out = mission.states.at(0).children.at(0);
  EXPECT_EQ(goals_of(out).at(0)->position.x.value, 6.0);
  EXPECT_EQ(out.timeout->on_timeout.value, "out_up");
  ASSERT_TRUE(out.transitions.at(0).guard);
  EXPECT_NE(mission.source.content().find("cond=\"elapsed &lt; &#50;00 s and"), std::string::npos);
  EXPECT_EQ(mission.states.at(0).children.at(1).id.value, "out_up") << "a fragment in a fragment";
}

// Text without parameters keeps its file, line and column.
void expect_lines_where_they_were_written(const std::string& path) {
  const Mission mission = loaded(path);
  std::map<std::string, std::vector<std::string>> files;
  int compared = 0;
  int elsewhere = 0;
  for (int number = 1; number <= mission.source.line_count(); ++number) {
    const std::string_view line = mission.source.line(number);
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == std::string_view::npos) continue;
    const LineOrigin origin = mission.source.origin(number);
    if (!files.contains(origin.path)) files[origin.path] = lines_of(origin.path);
    ASSERT_LE(static_cast<std::size_t>(origin.line), files[origin.path].size());
    const std::string& written = files[origin.path].at(static_cast<std::size_t>(origin.line - 1));
    if (written.find("${") != std::string::npos) continue;
    ++compared;
    EXPECT_EQ(written.substr(begin, line.size() - begin), line.substr(begin)) << number;
    EXPECT_EQ(origin.included_from.empty(), origin.path == path) << number;
    elsewhere += origin.included_from.empty() ? 0 : 1;
  }
  EXPECT_GT(compared, 15);
  EXPECT_GT(elsewhere, 1);
}

TEST(Expansion, RecordsWhereEveryLineWasWritten) {
  expect_lines_where_they_were_written(kMissions + "blocks.xml");
  expect_lines_where_they_were_written(kAccepted + "included.xml");
}

TEST(Expansion, DoesNotChangeAMissionThatNeedsNone) {
  std::ifstream stream(kMissions + "survey.xml");
  std::ostringstream text;
  text << stream.rdbuf();
  EXPECT_EQ(loaded(kMissions + "survey.xml").source.content(), text.str());
}

// The content of a log suffices for a replay.
TEST(Expansion, ComesToTheSameWhenReadAgainWithoutTheFragments) {
  const Mission mission = loaded(kMissions + "blocks.xml");
  Diagnostics diagnostics;
  const auto again = parse_mission(SourceText("log.xml", mission.source.content()), diagnostics,
                                   MapFile::kNotNeeded);
  ASSERT_TRUE(again) << rendered(diagnostics);
  EXPECT_EQ(again->source.content(), mission.source.content());
  EXPECT_EQ(again->states.size(), mission.states.size());
}

class Folder : public ::testing::Test {
 protected:
  Folder() {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "maps");
    fs::copy_file(kMissions + "maps/window.sdf", folder_ / "maps/window.sdf");
  }
  ~Folder() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  static std::string fragment(const std::string& content) {
    return "<fragment xmlns='urn:dive:mission:1'>" + content + "</fragment>";
  }

  // Diagnostics of a mission with these states and one that ends it.
  [[nodiscard]] Diagnostics check(const std::string& states) const {
    write("m.xml",
          "<mission xmlns='urn:dive:mission:1' id='m'>\n"
          "<vehicle model='aqua2' speed='0.4'/><map file='maps/window.sdf'/>\n"
          "<start x='-3' y='-2' z='3' z_units='DEPTH' heading_deg='0'/>\n"
          "<limits max_depth='9' min_altitude='0' clearance='0.6' mission_timeout='900' "
          "battery_reserve='0.2'/>\n<states initial='up'>\n" +
              states +
              "\n<surface id='up'><transition event='done.state.up' target='end'/></surface>"
              "<final id='end'/></states></mission>\n");
    Diagnostics diagnostics;
    static_cast<void>(load_mission((folder_ / "m.xml").string(), diagnostics));
    return diagnostics;
  }

  void expect_only(const std::string& states, const std::string& code,
                   const std::string& phrase) const {
    const Diagnostics diagnostics = check(states);
    ASSERT_GE(diagnostics.list().size(), 1U);
    for (const Diagnostic& diagnostic : diagnostics.list()) {
      EXPECT_EQ(diagnostic.code, code) << rendered(diagnostics);
      EXPECT_NE(diagnostic.message.find(phrase), std::string::npos) << rendered(diagnostics);
    }
  }

  // A separate folder per test, because tests run in parallel.
  const fs::path folder_ = fs::path(::testing::TempDir()) / "dive-expansion" /
                           ::testing::UnitTest::GetInstance()->current_test_info()->name();
};

std::string times(int count, const std::string& text) {
  std::string result;
  for (int i = 0; i < count; ++i) result += text;
  return result;
}

TEST_F(Folder, FragmentsMayBeEightDeepAndNoDeeper) {
  write("f9.xml", fragment("<!-- the last -->"));
  for (int i = 8; i >= 1; --i) {
    write(fmt::format("f{}.xml", i), fragment(fmt::format("<include href='f{}.xml'/>", i + 1)));
  }
  EXPECT_TRUE(check("<include href='f2.xml'/>").ok());
  expect_only("<include href='f1.xml'/>", "MIS-INCLUDE", "more than 8 deep");
}

TEST_F(Folder, TwoHundredAreIncludedAndNoMore) {
  write("nothing.xml", fragment(""));
  EXPECT_TRUE(check(times(200, "<include href='nothing.xml'/>")).ok());
  expect_only(times(201, "<include href='nothing.xml'/>"), "MIS-INCLUDE", "more than 200");
}

// Ten lines that expand to 2^40.
TEST_F(Folder, FragmentsThatMultiplyAreStopped) {
  for (int i = 0; i < 6; ++i) {
    write(fmt::format("f{}.xml", i),
          fragment(times(32, fmt::format("<include href='f{}.xml'/>", i + 1))));
  }
  write("f6.xml", fragment(times(1000, "<!-- a line -->")));
  const Diagnostics diagnostics = check("<include href='f0.xml'/>");
  EXPECT_FALSE(diagnostics.ok());
  EXPECT_LE(diagnostics.list().size(), Diagnostics::kMaxDiagnostics);
}

TEST_F(Folder, AMissionThatBecomesTooLargeIsStopped) {
  write("large.xml", fragment("<!-- " + std::string(300'000, '.') + " -->"));
  expect_only(times(5, "<include href='large.xml'/>"), "MIS-INCLUDE", "larger than 1024 KiB");
  write("wide.xml", fragment("<parameters><parameter name='p'/></parameters><!-- -->" +
                             times(4000, "<final id='${p}'/>")));
  expect_only(
      "<include href='wide.xml'><with name='p' value='" + std::string(4000, 'a') + "'/></include>",
      "MIS-INCLUDE", "larger than 1024 KiB");
}

TEST_F(Folder, ALinkOutOfTheFolderIsNotFollowed) {
  write("inside.xml", fragment(""));
  fs::create_symlink("inside.xml", folder_ / "linked.xml");
  EXPECT_TRUE(check("<include href='linked.xml'/>").ok());
  fs::create_symlink(kMissions + "parts/failsafes.xml", folder_ / "out.xml");
  expect_only("<include href='out.xml'/>", "MIS-INCLUDE", "outside of the mission's folder");
}

TEST_F(Folder, AFragmentThatCannotBeReadIsReported) {
  write("large.xml", std::string(2 << 20, ' '));
  expect_only("<include href='large.xml'/>", "FILE-UNREADABLE", "larger than");
}

TEST(Expansion, NeedsAFolder) {
  std::ifstream stream(kMissions + "blocks.xml");
  std::ostringstream text;
  text << stream.rdbuf();
  Diagnostics diagnostics;
  EXPECT_FALSE(
      parse_mission(SourceText("blocks.xml", text.str()), diagnostics, MapFile::kNotNeeded));
  EXPECT_EQ(diagnostics.list().at(0).code, "MIS-INCLUDE");
  EXPECT_NE(rendered(diagnostics).find("has no folder"), std::string::npos);
}

TEST(Expansion, NamesLinesOfOtherFilesInSentences) {
  Diagnostics diagnostics;
  const std::string path = DIVE_SOURCE_DIR "/test/mission/malformed/include_with_a_bad_value.xml";
  EXPECT_FALSE(load_mission(path, diagnostics));
  const std::string text = rendered(diagnostics);
  EXPECT_NE(text.find("malformed/parts/bad_value.xml:6:29: error: duration"), std::string::npos)
      << text;
  EXPECT_NE(text.find("included from " + path + ":12\n"), std::string::npos) << text;
}

}  // namespace
}  // namespace dive::mission
