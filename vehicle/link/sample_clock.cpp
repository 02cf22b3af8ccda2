#include "vehicle/link/sample_clock.h"

#include <algorithm>

namespace dive::link {

Utime SampleClock::ours(Utime utime, Utime arrived) {
  // Forged or broken times must not overflow: beyond a few centuries nothing is a time.
  constexpr Utime kCentury = Utime{100} * 366 * 86'400 * kMicrosecondsPerSecond;
  const Utime theirs = std::clamp(utime, -kCentury, kCentury);
  const Utime longest = from_seconds(kMaxAge);
  if (offset_) {
    const Utime age = arrived - (theirs + *offset_);
    if (age >= 0 && age <= longest) return theirs + *offset_;
    if (age < 0 && age >= -longest) {  // quicker under way than any before
      offset_ = arrived - theirs;
      return arrived;
    }
    ++jumps_;
  }
  offset_ = arrived - theirs;
  return arrived;
}

}  // namespace dive::link
