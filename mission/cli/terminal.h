#pragma once
// What a person sees: results on stdout, everything else on stderr. Colour and a line that
// rewrites itself only on a terminal; NO_COLOR is honoured.

#include <string>
#include <string_view>

#include "common/diagnostic.h"

namespace dive::mission {

/// Writes a line to stdout.
void print(std::string_view line);
/// Writes a line to stderr.
void note(std::string_view line);
/// "dive: error: ..." on stderr.
void complain(std::string_view message);
/// All diagnostics on stderr, then a count.
void print_diagnostics(const Diagnostics& diagnostics);
/// Writes a file; false (and a complaint) when that fails.
[[nodiscard]] bool write_file(const std::string& path, std::string_view content);

/// A line on stderr that is rewritten in place on a terminal, and printed now and then elsewhere.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  [[nodiscard]] bool on_terminal() const { return on_terminal_; }
  void show(std::string_view line);

 private:
  bool on_terminal_;
  bool open_ = false;
};

}  // namespace dive::mission
