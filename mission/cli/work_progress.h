#pragma once
// Progress of a command's work on stderr, for everything that may take longer than a second.

#include <string>

#include "common/clock.h"
#include "mission/cli/terminal.h"

namespace dive::mission {

/// "replaying: 42 %, 12 s left": from a second after its beginning on, ten times a second on a
/// terminal and every ten seconds elsewhere. Called from one thread at a time.
class WorkProgress {
 public:
  /// `what`: "replaying". Quiet: prints nothing.
  WorkProgress(Clock& clock, std::string what, bool is_quiet = false);

  /// The share of the work that is done, in [0, 1].
  void show(double share);
  /// Before something else is printed on the same terminal.
  void clear() { line_.clear(); }

 private:
  Clock& clock_;
  std::string what_;
  bool is_quiet_;
  ProgressLine line_;
  Utime began_;
  Utime next_;
};

}  // namespace dive::mission
