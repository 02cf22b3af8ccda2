#pragma once
// A folder for each test that runs the command.

#include <filesystem>
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

/// Runs `dive ARGUMENTS` in that folder.
inline Ran run_here(const std::string& arguments) { return run_dive(arguments, own_place()); }

}  // namespace dive::mission::testing
