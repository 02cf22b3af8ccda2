#pragma once
// A dive whose machine has not ended, for the simulator and for reports: "held" where a failsafe
// keeps the vehicle in one place, else a "failure".

#include <string>

#include "mission/executive/io.h"

namespace dive::mission {

inline constexpr double kSamePlace = 0.5;  ///< m from the last position that are one place.
inline constexpr double kMinRest = 30.0;   ///< s in one place at the end of a dive that is held.

struct UnfinishedDive {
  std::string state;
  double duration_s = 0.0;
  double rest_s = 0.0;  ///< Time in one place at the end.
  bool is_held = false;
  std::string why;  ///< Of the failsafe that holds it; may be empty.

  [[nodiscard]] const char* outcome() const { return is_held ? "held" : "failure"; }
  [[nodiscard]] std::string cause() const;
};

/// True if a failsafe keeps the vehicle from continuing.
[[nodiscard]] bool is_kept(const Status& status);

}  // namespace dive::mission
