// Pages of the documentation: their commands do what the pages say, and their links lead somewhere.
#include "test/documentation/page.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "test/common/file_content.h"

namespace dive::documentation {
namespace {

namespace fs = std::filesystem;
using dive::testing::content_of;

/// An empty folder that disappears with the object.
class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "dive-page-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::vector<std::string> mistakes_of(const std::string& page) {
  const Folder folder;
  return mistakes_in(steps_of(page), folder.path(), fs::path(DIVE_COMMAND).parent_path());
}

class Page : public ::testing::TestWithParam<const char*> {};

TEST_P(Page, CommandsDoWhatItSays) {
  const std::string page = content_of(fs::path(DIVE_SOURCE_DIR) / "doc" / GetParam());
  ASSERT_FALSE(steps_of(page).empty());
  for (const std::string& mistake : mistakes_of(page)) {
    ADD_FAILURE() << "doc/" << GetParam() << ", " << mistake;
  }
}

INSTANTIATE_TEST_SUITE_P(Documentation, Page,
                         ::testing::Values("tutorial.md", "how-to/own-map.md",
                                           "how-to/own-vehicle.md", "how-to/read-a-report.md"),
                         [](const auto& instance) {
                           std::string name = fs::path(instance.param).stem().string();
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

// What demo.sh does once the program is built, in a folder without results of earlier dives.
TEST(Demo, DivesAndEndsWithThePathOfItsReport) {
  const fs::path root = DIVE_SOURCE_DIR;
  const std::string demo = content_of(root / "demo.sh");
  const std::string first = "dive=build/release/dive\n";
  ASSERT_NE(demo.find(first), std::string::npos);
  const Folder folder;
  fs::create_directory_symlink(root / "missions", folder.path() / "missions");
  std::ofstream(folder.path() / "steps.sh") << "set -euo pipefail\ndive='" << DIVE_COMMAND << "'\n"
                                            << demo.substr(demo.find(first) + first.size());
  const std::string command =
      fmt::format("cd '{}' && bash steps.sh >out.txt 2>&1 </dev/null", folder.path().string());
  EXPECT_EQ(std::system(command.c_str()), 0) << content_of(folder.path() / "out.txt");
  std::string last = content_of(folder.path() / "out.txt");
  last.erase(last.find_last_not_of('\n') + 1);
  last.erase(0, last.find_last_of('\n') + 1);
  EXPECT_EQ(last, (folder.path() / "dive-runs/window.html").string());
  EXPECT_TRUE(fs::exists(last));
}

TEST(Pages, TheReferenceOfTheLanguageIsThatOfTheSchema) {
  const Folder folder;
  const std::string command = fmt::format("cd '{}' && '{}' generate share >out.txt 2>&1",
                                          folder.path().string(), DIVE_COMMAND);
  ASSERT_EQ(std::system(command.c_str()), 0) << content_of(folder.path() / "out.txt");
  EXPECT_EQ(content_of(folder.path() / "share/doc/dive/mission-language.md"),
            content_of(fs::path(DIVE_SOURCE_DIR) / "doc/mission-language.md"))
      << "write it again: dive generate share; cp share/doc/dive/mission-language.md doc/";
}

TEST(Pages, LinkToFilesThatExist) {
  const fs::path root = DIVE_SOURCE_DIR;
  int links = 0;
  for (auto entry = fs::recursive_directory_iterator(root); entry != fs::end(entry); ++entry) {
    const std::string name = entry->path().filename();
    if (entry->is_directory() && (name == "build" || name.starts_with("."))) {
      entry.disable_recursion_pending();
    }
    if (entry->path().extension() != ".md") continue;
    for (const std::string& file : linked_files(content_of(entry->path()))) {
      ++links;
      EXPECT_TRUE(fs::exists(entry->path().parent_path() / file))
          << entry->path() << " links to " << file;
    }
  }
  EXPECT_GT(links, 50);
}

constexpr const char* kGood =
    "```console\n$ printf 'one\\ntwo 2.5 ms\\nthree\\n'\none\ntwo ... ms\n...\n$ false\n$ echo "
    "$?\n1\n```\n";

TEST(PageCheck, AcceptsWhatIsAsThePageSays) { EXPECT_TRUE(mistakes_of(kGood).empty()); }

TEST(PageCheck, ReportsEveryDifference) {
  for (const char* page : {
           "```console\n$ false\n```\n",                        // a failure that is not stated
           "```console\n$ true\n$ echo $?\n1\n```\n",           // a success stated as a failure
           "```console\n$ echo one\ntwo\n```\n",                // another output
           "```console\n$ printf 'a\\nb\\n'\nb\n```\n",         // a line left out before
           "```console\n$ printf 'a\\nb\\n'\na\n```\n",         // a line left out at the end
           "```console\n$ printf 'a\\nb\\n'\nb\na\n...\n```\n"  // another order
       }) {
    EXPECT_EQ(mistakes_of(page).size(), 1) << page;
  }
}

TEST(PageCheck, WritesTheFilesOfThePage) {
  EXPECT_TRUE(mistakes_of("```xml a.xml\n<a/>\n```\n```console\n$ cat a.xml\n<a/>\n```\n").empty());
}

}  // namespace
}  // namespace dive::documentation
