#pragma once
// Terminal output: results on stdout, everything else on stderr. Colour and rewritten lines only on
// a terminal; NO_COLOR is respected.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "common/clock.h"
#include "common/diagnostic.h"
#include "mission/record/collision.h"

namespace dive::mission {

/// Writes a line to stdout; an error is reported by finish_standard_output().
void print(std::string_view line);
/// Writes a line to stderr.
void note(std::string_view line);
/// At the start of the process: descriptors 0 to 2 that are closed would be given to the next files
/// opened, and what is printed would go into these.
void occupy_standard_streams();

/// At its end: `status`, or 3 after printing an error if something printed on standard output could
/// not be written.
[[nodiscard]] int finish_standard_output(int status);

/// "dive: error: ..." on stderr.
void complain(std::string_view message);
/// All diagnostics on stderr, then a count.
void print_diagnostics(const Diagnostics& diagnostics);

/// "9 s", "3 min 20 s", "2 h 5 min".
[[nodiscard]] std::string rounded_duration(double seconds);

/// "24 kB", "1.5 MB".
[[nodiscard]] std::string rounded_size(std::size_t bytes);

/// ", 12 s left" after `elapsed_s` with that share of the work done; empty if it says nothing.
[[nodiscard]] std::string time_left(double share, double elapsed_s);

/// A line on stderr that is rewritten in place on a terminal, and printed periodically elsewhere.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  [[nodiscard]] bool on_terminal() const { return on_terminal_; }
  /// Time between two calls of show(), us.
  [[nodiscard]] Utime period() const;
  void show(std::string_view line);
  /// Removes the rewritten line.
  void clear();
  /// Prints a permanent line above the rewritten one.
  void keep(std::string_view line);

 private:
  bool on_terminal_;
  bool open_ = false;
};

/// Prints the nearest approach and one line per collision on stdout.
void print_contacts(const NearestApproach& nearest, std::span<const Collision> collisions);

}  // namespace dive::mission
