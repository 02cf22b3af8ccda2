#pragma once
// Time. LCM's utime everywhere: int64 microseconds. Only what is handed a Clock may ask for it.

#include <cstdint>

namespace dive {

using Utime = std::int64_t;  ///< Microseconds; simulated time starts at 0.

inline constexpr Utime kMicrosecondsPerSecond = 1'000'000;

/// Seconds as a number, for arithmetic and for people.
[[nodiscard]] constexpr double to_seconds(Utime utime) { return static_cast<double>(utime) * 1e-6; }

/// Rounds to the nearest microsecond.
[[nodiscard]] constexpr Utime from_seconds(double seconds) {
  return static_cast<Utime>(seconds * 1e6 + (seconds < 0.0 ? -0.5 : 0.5));
}

/// Where time comes from.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual Utime now() = 0;
  /// How long the machine takes for so much of this time.
  [[nodiscard]] virtual Utime real(Utime duration) const { return duration; }
};

/// The machine's monotonic clock.
class SteadyClock final : public Clock {
 public:
  [[nodiscard]] Utime now() override;
};

/// The same, so many times as fast.
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
