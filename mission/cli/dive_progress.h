#pragma once
// The line that a dive under way is told in.

#include "common/clock.h"
#include "mission/cli/terminal.h"
#include "mission/executive/io.h"

namespace dive::mission {

/// Once a second of dive time on a terminal, every ten elsewhere.
class DiveProgress {
 public:
  void observe(const StepInputs& inputs, const StepOutputs& outputs);

 private:
  ProgressLine line_;
  Utime next_ = 0;
};

}  // namespace dive::mission
