#include "vehicle/link/sample_clock.h"

#include <algorithm>

namespace dive::link {
namespace {

constexpr Utime kMaxLatency = from_seconds(SampleClock::kMaxAge);

// Forged or broken times must not overflow: times beyond a few centuries are clamped.
Utime bounded(Utime utime) {
  constexpr Utime kCentury = Utime{100} * 366 * 86'400 * kMicrosecondsPerSecond;
  return std::clamp(utime, -kCentury, kCentury);
}

}  // namespace

Utime SampleClock::ours(Utime utime, Utime arrived) {
  if (const std::optional<Utime> taken = follow(utime, arrived)) return *taken;
  if (offset_) ++jumps_;
  offset_ = arrived - bounded(utime);
  return arrived;
}

std::optional<Utime> SampleClock::follow(Utime utime, Utime arrived) {
  if (!offset_) return std::nullopt;
  const Utime theirs = bounded(utime);
  const Utime age = arrived - (theirs + *offset_);
  if (age > kMaxLatency || age < -kMaxLatency) return std::nullopt;
  if (age < 0) offset_ = arrived - theirs;  // smaller latency than any before
  return theirs + *offset_;
}

}  // namespace dive::link
