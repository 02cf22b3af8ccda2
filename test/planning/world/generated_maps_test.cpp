// The maps written by a script are equal to its present output.

#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "test/common/file_content.h"

namespace dive::planning {
namespace {

namespace fs = std::filesystem;
using dive::testing::content_of;

TEST(GeneratedMaps, AreWhatTheScriptWrites) {
  if (std::system("python3 --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "there is no python3";
  const fs::path maps = fs::path(DIVE_SOURCE_DIR) / "missions/maps";
  std::string pattern = (fs::temp_directory_path() / "dive-maps-XXXXXX").string();
  const fs::path folder = mkdtemp(pattern.data());
  const std::string command =
      "python3 -B '" + (maps / "generate.py").string() + "' '" + folder.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  int written = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    ++written;
    EXPECT_EQ(content_of(entry.path()), content_of(maps / entry.path().filename())) << entry.path();
  }
  EXPECT_EQ(written, 6);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace dive::planning
