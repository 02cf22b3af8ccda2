#pragma once
// Runs the command as a user or a script does.

#include <filesystem>
#include <string>

namespace dive::mission::testing {

struct Ran {
  int status = -1;  ///< Exit status; 128 + signal when it was killed.
  std::string out;
  std::string err;
};

/// `dive ARGUMENTS`, in a folder of its own named `place`, after the shell words `setup`.
[[nodiscard]] Ran run_dive(const std::string& arguments, const std::string& place,
                           const std::string& setup = {});

/// All of a file; empty when there is none.
[[nodiscard]] std::string content_of(const std::filesystem::path& path);

}  // namespace dive::mission::testing
