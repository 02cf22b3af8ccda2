#pragma once
// The samples of a dive of any length in bounded memory. Private to mission/report.

#include <cstddef>
#include <utility>
#include <vector>

#include "common/clock.h"
#include "mission/report/report.h"

namespace dive::mission {

/// Keeps one sample per period and every marked one. When it is full the period doubles, and every
/// second sample that is not marked is removed.
class SampleList {
 public:
  explicit SampleList(std::size_t capacity) : capacity_(capacity) {}

  /// True if the tick at `now` is kept without a mark.
  [[nodiscard]] bool is_due(Utime now) const { return now >= next_; }
  /// Ascending in time.
  void add(Utime now, DiveSample sample, bool is_marked);

  [[nodiscard]] double period_s() const { return to_seconds(period_); }
  [[nodiscard]] std::vector<DiveSample> take() { return std::move(samples_); }

 private:
  void thin_out();

  std::size_t capacity_;
  std::vector<DiveSample> samples_;
  std::vector<bool> is_marked_;
  Utime period_ = kMicrosecondsPerSecond / 10;
  Utime next_ = 0;
};

}  // namespace dive::mission
