#pragma once
// Progress of `dive check` on stderr.

#include <string>

#include "common/clock.h"
#include "mission/check/check.h"
#include "mission/cli/terminal.h"

namespace dive::mission {

/// "[=======>            ]", `width` characters within the brackets; fraction in [0, 1].
[[nodiscard]] std::string progress_bar(double fraction, int width);

/// Prints each step and finding on a line; below them a bar with the remaining time, rewritten ten
/// times a second on a terminal, or a line every ten seconds elsewhere.
class CheckProgress final : public CheckObserver {
 public:
  CheckProgress(Clock& clock, bool is_quiet) : clock_(clock), is_quiet_(is_quiet) {}

  void on_step(const std::string& what) override;
  void on_progress(double done, double total, const std::string& unit, double share) override;
  void on_finding(const FaultResult& result, const std::string& command) override;

 private:
  Clock& clock_;
  bool is_quiet_;
  ProgressLine line_;
  Utime step_began_ = 0;
  Utime next_ = 0;  ///< Time of the next redraw.
  int findings_ = 0;
};

}  // namespace dive::mission
