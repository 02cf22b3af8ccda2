#pragma once
// A folder for each test that runs the command.

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "test/mission/cli/run_command.h"

namespace dive::mission::testing {

/// Name of the folder of the test that is running.
[[nodiscard]] inline std::string own_place() {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  return fmt::format("{}-{}", test->test_suite_name(), test->name());
}

[[nodiscard]] inline std::filesystem::path own_folder() {
  std::filesystem::path path =
      std::filesystem::path(::testing::TempDir()) / "dive-command" / own_place();
  std::filesystem::create_directories(path);
  return path;
}

/// Runs `dive ARGUMENTS` in that folder, after the shell words `setup`.
inline Ran run_here(const std::string& arguments, const std::string& setup = {}) {
  return run_dive(arguments, own_place(), setup);
}

/// Writes a file in that folder; replaces one that is read-only too.
inline void write_here(const std::filesystem::path& name, const std::string& text) {
  const std::filesystem::path path = own_folder() / name;
  std::filesystem::create_directories(path.parent_path());
  std::filesystem::remove(path);
  std::ofstream(path) << text;
}

/// A shipped mission, quoted for the shell.
[[nodiscard]] inline std::string shipped(const std::string& name) {
  return fmt::format("'{}/missions/{}.xml'", DIVE_SOURCE_DIR, name);
}

}  // namespace dive::mission::testing
