#pragma once
// Time in LCM's unit, int64 microseconds. Only code that is given a Clock may read the time.

#include <cstdint>

namespace dive {

using Utime = std::int64_t;  ///< Microseconds; simulated time starts at 0.

inline constexpr Utime kMicrosecondsPerSecond = 1'000'000;

/// Seconds as a floating-point number.
[[nodiscard]] constexpr double to_seconds(Utime utime) { return static_cast<double>(utime) * 1e-6; }

/// Rounds to the nearest microsecond.
[[nodiscard]] constexpr Utime from_seconds(double seconds) {
  return static_cast<Utime>(seconds * 1e6 + (seconds < 0.0 ? -0.5 : 0.5));
}

/// A source of time.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual Utime now() = 0;
  /// The machine's own duration of a `duration` of this clock.
  [[nodiscard]] virtual Utime real(Utime duration) const { return duration; }
};

/// The machine's monotonic clock.
class SteadyClock final : public Clock {
 public:
  [[nodiscard]] Utime now() override;
};

/// The machine's monotonic clock, sped up by a constant factor.
class FastClock final : public Clock {
 public:
  /// `factor` > 0.
  explicit FastClock(double factor) : factor_(factor), start_(steady_.now()) {}
  [[nodiscard]] Utime now() override;
  [[nodiscard]] Utime real(Utime duration) const override;

 private:
  SteadyClock steady_;
  double factor_;
  Utime start_;
};

}  // namespace dive
