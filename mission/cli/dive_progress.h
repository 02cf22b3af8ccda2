#pragma once
// The progress line of a dive.

#include "common/clock.h"
#include "mission/cli/terminal.h"
#include "mission/executive/io.h"

namespace dive::mission {

/// Prints once per second of dive time on a terminal, every ten elsewhere.
class DiveProgress {
 public:
  void observe(const StepInputs& inputs, const StepOutputs& outputs);

 private:
  ProgressLine line_;
  Utime next_ = 0;
};

}  // namespace dive::mission
