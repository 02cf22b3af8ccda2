#include "test/mission/cli/run_command.h"

#include <cstdlib>
#include <filesystem>
#include <system_error>

#include <gtest/gtest.h>
#include <sys/wait.h>

namespace dive::mission::testing {

namespace fs = std::filesystem;

namespace {

/// A folder of this process for ::testing::TempDir(): results of an earlier run of the tests would
/// be in the way of the present ones.
class Scratch {
 public:
  Scratch() {
    std::string pattern = (fs::temp_directory_path() / "dive-test-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    ::setenv("TEST_TMPDIR", folder_.c_str(), 1);
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

 private:
  fs::path folder_;
};

const Scratch scratch;

}  // namespace

Ran run_dive(const std::string& arguments, const std::string& place, const std::string& setup) {
  const fs::path folder = fs::path(::testing::TempDir()) / "dive-command" / place;
  fs::create_directories(folder);
  const std::string command = "cd '" + folder.string() + "' && " + setup + " '" DIVE_COMMAND "' " +
                              arguments + " >out.txt 2>err.txt </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          content_of(folder / "out.txt"), content_of(folder / "err.txt")};
}

}  // namespace dive::mission::testing
