#include "test/mission/cli/run_command.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <sys/wait.h>

namespace dive::mission::testing {

namespace fs = std::filesystem;

std::string content_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

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
