#pragma once
// Time spent in a stage of planning.

#include "common/clock.h"

namespace dive::planning {

/// Adds the time from its construction to its destruction to a total.
class Stopwatch {
 public:
  Stopwatch(Clock& clock, double& total_ms)
      : clock_(clock), total_ms_(total_ms), start_(clock.now()) {}
  ~Stopwatch() { total_ms_ += static_cast<double>(clock_.now() - start_) * 1e-3; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  Clock& clock_;
  double& total_ms_;
  Utime start_;
};

}  // namespace dive::planning
