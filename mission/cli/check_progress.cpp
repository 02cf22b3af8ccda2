#include "mission/cli/check_progress.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace dive::mission {
namespace {

constexpr int kBarWidth = 24;

}  // namespace

std::string progress_bar(double fraction, int width) {
  const auto filled = static_cast<std::size_t>(std::lround(std::clamp(fraction, 0.0, 1.0) * width));
  std::string bar(filled, '=');
  bar.resize(static_cast<std::size_t>(width), ' ');
  if (filled > 0) bar[filled - 1] = '>';
  return "[" + bar + "]";
}

void CheckProgress::on_step(const std::string& what) {
  step_began_ = clock_.now();
  next_ = step_began_ + (line_.on_terminal() ? 0 : line_.period());
  if (!is_quiet_) line_.keep("check: " + what);
}

void CheckProgress::on_progress(double done, double total, const std::string& unit, double share) {
  const Utime now = clock_.now();
  if (is_quiet_ || now < next_) return;
  next_ = now + line_.period();
  const std::string found = findings_ > 0 ? fmt::format(", {} finding(s)", findings_) : "";
  const std::string bar = line_.on_terminal() ? progress_bar(share, kBarWidth) + " " : "";
  // The duration of a dive is an estimate and may be exceeded.
  const std::string amount = done > total
                                 ? fmt::format("{:.0f} {}, expected {:.0f}", done, unit, total)
                                 : fmt::format("{:.0f} of {:.0f} {}", done, total, unit);
  line_.show(fmt::format("check: {}{}{}{}", bar, amount, found,
                         time_left(share, to_seconds(now - step_began_))));
}

void CheckProgress::on_finding(const FaultResult& result, const std::string& command) {
  ++findings_;
  if (!is_quiet_) line_.keep(fmt::format("check: unsafe: {}: {}", describe(result), command));
}

}  // namespace dive::mission
