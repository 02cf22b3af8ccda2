#pragma once
// A sensor's clock is not ours: it began at another time, and it may jump.

#include <optional>

#include "common/clock.h"

namespace dive::link {

/// Turns a sensor's times into ours. Trusts it as long as what arrives is as old as things that are
/// under way are; a time that lies ahead of ours or far behind means that its clock was set.
class SampleClock {
 public:
  static constexpr double kMaxAge = 0.5;  ///< s that a sample may have been under way.

  /// When, on our clock, a sample was taken that bears `utime` and arrived at `arrived`; never
  /// later than that. Times that go back a little are packets out of order, and stay so.
  [[nodiscard]] Utime ours(Utime utime, Utime arrived);

  /// Likewise of another sensor that goes by the same clock, but never sets it: nothing for what is
  /// older than things that are under way, or of a time to come.
  [[nodiscard]] std::optional<Utime> follow(Utime utime, Utime arrived);

  /// How often it was set so far.
  [[nodiscard]] int jumps() const { return jumps_; }

 private:
  std::optional<Utime> offset_;  ///< Ours less the sensor's.
  int jumps_ = 0;
};

}  // namespace dive::link
