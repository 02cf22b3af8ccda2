#pragma once
// The progress line of a dive.

#include "common/background_output.h"
#include "common/clock.h"
#include "mission/cli/terminal.h"
#include "mission/executive/io.h"

namespace dive::mission {

/// Prints once per second of dive time on a terminal, every ten elsewhere.
/// Another thread prints: a terminal or pipe that is not read delays nothing, and lines are
/// dropped.
class DiveProgress {
 public:
  DiveProgress();
  ~DiveProgress();
  DiveProgress(const DiveProgress&) = delete;
  DiveProgress& operator=(const DiveProgress&) = delete;

  void observe(const StepInputs& inputs, const StepOutputs& outputs);

 private:
  bool on_terminal_;
  BackgroundOutput output_;
  Utime next_ = 0;
};

}  // namespace dive::mission
