// doc/how-to/add-a-behavior.md keeps its promise: the files in its table are all that name the
// state `orbit`.

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "test/common/file_content.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using dive::testing::content_of;

const fs::path kRoot = DIVE_SOURCE_DIR;

int lines_naming_orbit(const fs::path& path) {
  std::ifstream stream(path);
  int count = 0;
  for (std::string line; std::getline(stream, line);) {
    std::ranges::transform(line, line.begin(), [](unsigned char c) { return std::tolower(c); });
    // The camera controls of three.js are no state of a mission.
    line = std::regex_replace(line, std::regex("orbitcontrols"), "");
    if (line.find("orbit") != std::string::npos) ++count;
  }
  return count;
}

// The paths in the first column of the document's tables.
std::set<std::string> files_in_table() {
  const std::string text = content_of(kRoot / "doc/how-to/add-a-behavior.md");
  const std::regex row("(^|\n)\\| `([^`]+)` \\|");
  std::set<std::string> files;
  for (std::sregex_iterator at(text.begin(), text.end(), row), end; at != end; ++at) {
    files.insert((*at)[2]);
  }
  return files;
}

bool is_source(const fs::path& path) {
  static const std::set<std::string> kExtensions = {".h", ".cpp", ".txt", ".cmake", ".xsd", ".lcm"};
  return kExtensions.contains(path.extension().string());
}

TEST(HowToAddABehavior, NamesFilesThatAreThereAndHaveToDoWithIt) {
  const std::set<std::string> files = files_in_table();
  ASSERT_GE(files.size(), 8U);
  for (const std::string& file : files) {
    ASSERT_TRUE(fs::exists(kRoot / file)) << file;
    EXPECT_GT(lines_naming_orbit(kRoot / file), 0) << file;
  }
}

TEST(HowToAddABehavior, NamesAllSourcesThatNameTheState) {
  const std::set<std::string> files = files_in_table();
  std::set<std::string> sources;
  // A study in bench/ may dive its mission, which a new state need not know.
  for (const char* folder : {"behaviors", "cmake", "common", "estimation", "mission", "missions",
                             "planning", "vehicle"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      if (!entry.is_regular_file() || !is_source(entry.path())) continue;
      if (lines_naming_orbit(entry.path()) == 0) continue;
      sources.insert(fs::relative(entry.path(), kRoot).generic_string());
    }
  }
  EXPECT_EQ(sources.size(), 6U) << "its own four, the schema and the registry";
  for (const std::string& source : sources) {
    EXPECT_TRUE(files.contains(source)) << source << " names the state, but is not in the document";
  }
}

// An include and an entry.
TEST(HowToAddABehavior, PromisesOneEntryInTheRegistry) {
  EXPECT_EQ(lines_naming_orbit(kRoot / "mission/states/state_elements.cpp"), 2);
}

}  // namespace
}  // namespace dive::mission
