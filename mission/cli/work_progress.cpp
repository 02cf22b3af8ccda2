#include "mission/cli/work_progress.h"

#include <utility>

#include <fmt/format.h>

namespace dive::mission {
WorkProgress::WorkProgress(Clock& clock, std::string what, bool is_quiet)
    : clock_(clock),
      what_(std::move(what)),
      is_quiet_(is_quiet),
      began_(clock.now()),
      next_(began_ + (line_.on_terminal() ? kMicrosecondsPerSecond : line_.period())) {}

void WorkProgress::show(double share) {
  const Utime now = clock_.now();
  if (is_quiet_ || now < next_) return;
  next_ = now + line_.period();
  line_.show(fmt::format("{}: {:.0f} %{}", what_, 100.0 * share,
                         time_left(share, to_seconds(now - began_))));
}

}  // namespace dive::mission
