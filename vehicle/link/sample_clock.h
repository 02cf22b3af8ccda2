#pragma once
// Conversion of a sensor's time: its clock has another origin and may jump.

#include <optional>

#include "common/clock.h"

namespace dive::link {

/// Converts a sensor's times to ours. Accepts the sensor's clock while the implied latency is
/// plausible; a time ahead of ours or far behind means that the sensor's clock was set.
class SampleClock {
 public:
  static constexpr double kMaxAge = 0.5;  ///< Maximum plausible latency of a sample, s.

  /// The time on our clock of a sample stamped `utime` that arrived at `arrived`; never later than
  /// that. Times that go back a little are packets out of order, and stay out of order.
  [[nodiscard]] Utime ours(Utime utime, Utime arrived);

  /// The same for another sensor on the same clock, but without setting the offset: empty for an
  /// implausible latency or a time in the future.
  [[nodiscard]] std::optional<Utime> follow(Utime utime, Utime arrived);

  /// Number of times the sensor's clock was set.
  [[nodiscard]] int jumps() const { return jumps_; }

 private:
  std::optional<Utime> offset_;  ///< Our time less the sensor's.
  int jumps_ = 0;
};

}  // namespace dive::link
