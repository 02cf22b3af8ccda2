// Every file of test/mission/malformed gets exactly the diagnostics of its table, and every file of
// test/mission/accepted is accepted.

#include <filesystem>
#include <iterator>
#include <regex>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "common/source_text.h"
#include "mission/check/rules.h"
#include "mission/document/map_file.h"
#include "mission/executive/machine.h"
#include "planning/world/sdf.h"
#include "test/common/file_content.h"
#include "test/mission/check/mission_files.h"
#include "vehicle/model.h"

namespace dive::mission {
namespace {

using testing::Expected;
using testing::MissionFile;

// All diagnostics of a mission that need no planning.
Diagnostics check(const std::string& path) {
  Diagnostics diagnostics;
  const std::optional<Mission> mission = load_mission(path, diagnostics);
  EXPECT_EQ(mission.has_value(), diagnostics.ok()) << path;
  if (!mission) return diagnostics;
  const std::optional<planning::World> world = planning::load_sdf(mission->map_path, diagnostics);
  if (!world) return diagnostics;
  const auto map = read_source_text(mission->map_path, 1U << 20U);
  if (map) check_map_origin(*mission, *map, diagnostics);
  Diagnostics of_vehicle;
  const std::optional<vehicle::Model> vehicle =
      vehicle::parse_urdf(vehicle::aqua2_urdf(), of_vehicle);
  EXPECT_TRUE(vehicle);
  if (vehicle) check_against_world(*mission, *world, vehicle->hull, diagnostics);
  return diagnostics;
}

std::string rendered(const Diagnostics& diagnostics) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics.list()) text += render(diagnostic, false);
  return text;
}

void expect_exactly(const std::vector<Expected>& expected, Severity severity,
                    const Diagnostics& diagnostics) {
  std::vector<const Diagnostic*> found;
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    if (diagnostic.severity == severity) found.push_back(&diagnostic);
  }
  ASSERT_EQ(found.size(), expected.size()) << rendered(diagnostics);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i]->code, expected[i].code) << render(*found[i], false);
    EXPECT_EQ(found[i]->span.line, expected[i].line) << render(*found[i], false);
    EXPECT_GT(found[i]->span.column, 0) << render(*found[i], false);
    EXPECT_NE((found[i]->message + "\n" + found[i]->hint).find(expected[i].phrase),
              std::string::npos)
        << render(*found[i], false) << "should contain: " << expected[i].phrase;
  }
}

class Malformed : public ::testing::TestWithParam<MissionFile> {};

TEST_P(Malformed, IsRefusedWithItsOwnDiagnostic) {
  const MissionFile& file = GetParam();
  ASSERT_FALSE(file.expected.empty());
  expect_exactly(file.expected, Severity::kError, check(file.path()));
}

class Accepted : public ::testing::TestWithParam<MissionFile> {};

TEST_P(Accepted, MakesAMachine) {
  Diagnostics diagnostics;
  const std::optional<Mission> mission = load_mission(GetParam().path(), diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  EXPECT_NO_THROW(static_cast<void>(build_machine(*mission)));
}

TEST_P(Accepted, IsRead) {
  const Diagnostics diagnostics = check(GetParam().path());
  EXPECT_TRUE(diagnostics.ok()) << rendered(diagnostics);
  expect_exactly(GetParam().expected, Severity::kWarning, diagnostics);
}

std::string test_name(const ::testing::TestParamInfo<MissionFile>& info) {
  return info.param.name.substr(0, info.param.name.find('.'));
}

INSTANTIATE_TEST_SUITE_P(Missions, Malformed,
                         ::testing::ValuesIn(testing::mission_files("malformed")), test_name);
INSTANTIATE_TEST_SUITE_P(Missions, Accepted,
                         ::testing::ValuesIn(testing::mission_files("accepted")), test_name);

TEST(MissionFiles, AreTheTables) {
  for (const std::string folder : {"malformed", "accepted"}) {
    std::set<std::string> in_table;
    for (const MissionFile& file : testing::mission_files(folder)) {
      EXPECT_TRUE(in_table.insert(file.name).second) << file.name << " is in two places";
    }
    std::set<std::string> in_folder;
    for (const auto& entry : std::filesystem::directory_iterator(std::string(DIVE_SOURCE_DIR) +
                                                                 "/test/mission/" + folder)) {
      if (entry.path().extension() == ".xml") in_folder.insert(entry.path().filename());
    }
    EXPECT_EQ(in_table, in_folder);
  }
}

TEST(AllRules, AreExactlyThoseThatTheFilesBreak) {
  std::set<std::string> listed;
  for (const Rule& rule : all_rules()) {
    EXPECT_TRUE(listed.insert(rule.code).second) << rule.code << " is listed twice";
    EXPECT_STRNE(rule.sentence, "");
  }
  // No small file can violate these; those of the map have separate tests (test/planning/world).
  std::set<std::string> broken = {"FILE-UNREADABLE", "XML-SCAN", "XML-SIZE", "XML-COUNT"};
  for (const Rule& rule : map_rules()) broken.insert(rule.code);
  for (const std::string folder : {"malformed", "accepted"}) {
    for (const MissionFile& file : testing::mission_files(folder)) {
      for (const Expected& expected : file.expected) broken.insert(expected.code);
    }
  }
  EXPECT_EQ(listed, broken);
}

// Every code of the map reader is listed.
TEST(MapRules, AreThoseOfTheReader) {
  std::set<std::string> written;
  const std::regex code("\"(MAP-[A-Z-]+)\"");
  for (const char* name : {"sdf", "sdf_geometry", "sdf_origin", "mesh_source", "mesh_remarks"}) {
    const std::string path = fmt::format("{}/planning/world/{}", DIVE_SOURCE_DIR, name);
    for (const char* extension : {".h", ".cpp"}) {
      const std::string text = dive::testing::content_of(path + extension);
      for (std::sregex_iterator at(text.begin(), text.end(), code), end; at != end; ++at) {
        written.insert((*at)[1]);
      }
    }
  }
  std::set<std::string> listed;
  for (const Rule& rule : map_rules()) listed.insert(rule.code);
  EXPECT_EQ(listed, written);
}

TEST(WindowMission, HasNothingToComplainAbout) {
  const Diagnostics diagnostics = check(DIVE_SOURCE_DIR "/missions/window.xml");
  EXPECT_TRUE(diagnostics.list().empty()) << rendered(diagnostics);
}

}  // namespace
}  // namespace dive::mission
