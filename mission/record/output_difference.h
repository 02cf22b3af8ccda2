#pragma once
// first_difference() of log.h for two logs, neither of which is a replay of the other.

#include <string>

#include "mission/executive/io.h"

namespace dive::mission {

/// What the two sides are called.
struct OutputNames {
  const char* first = "logged";
  const char* second = "replayed";
};

[[nodiscard]] std::string first_difference(const StepOutputs& a, const StepOutputs& b,
                                           const OutputNames& names);

}  // namespace dive::mission
