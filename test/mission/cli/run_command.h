#pragma once
// Runs the command as a user or a script does.

#include <string>

#include "test/common/file_content.h"

namespace dive::mission::testing {

struct Ran {
  int status = -1;  ///< Exit status; 128 + signal if it was killed.
  std::string out;
  std::string err;
};

/// Runs `dive ARGUMENTS` in a separate folder named `place`, after the shell words `setup`.
[[nodiscard]] Ran run_dive(const std::string& arguments, const std::string& place,
                           const std::string& setup = {});

using dive::testing::content_of;

}  // namespace dive::mission::testing
