#pragma once
// The commands of a page of the documentation, and what it says that they print.
//
// In a block ```console a line that begins with "$ " is a command, the lines that follow it are
// its output (lines that begin with "> " right after it continue the command): exactly these lines,
// except that "..." inside a line stands for any text, and a line
// "..." for any lines. The commands run one after the other in one folder; each must succeed,
// unless `echo $?` follows it and states another status. A block ```LANGUAGE FILE is written into
// FILE.

#include <filesystem>
#include <string>
#include <vector>

namespace dive::documentation {

struct Step {
  int line = 0;  ///< In the page, 1-based.
  std::string command;
  std::vector<std::string> expected;  ///< Lines of output.
  std::string file;                   ///< Not empty: a file to write, with the lines `expected`.
};

[[nodiscard]] std::vector<Step> steps_of(const std::string& page);

/// Empty if the output is as expected, otherwise the first expected line that is missing, or the
/// first line that the page leaves out without "...".
[[nodiscard]] std::string difference(const std::vector<std::string>& expected,
                                     const std::string& output);

/// Runs the steps in `folder`, with `path` before PATH. One text for each step that is not as the
/// page says.
[[nodiscard]] std::vector<std::string> mistakes_in(const std::vector<Step>& steps,
                                                   const std::filesystem::path& folder,
                                                   const std::string& path);

/// The targets of links to other files, without "#...".
[[nodiscard]] std::vector<std::string> linked_files(const std::string& page);

}  // namespace dive::documentation
