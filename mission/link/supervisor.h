#pragma once
// Brings the vehicle up when the executive is dead or hangs: listens for its commands, and when
// they stop commands the vehicle's own autopilot to the surface until it is there. Small on
// purpose: it knows no mission, no map and no plan.

#include <functional>
#include <string>

#include "common/clock.h"
#include "vehicle/link/bus.h"

namespace dive::mission {

struct SupervisorSettings {
  double silence_s = 1.0;  ///< Without a new command of the executive, after its first.
};

struct SupervisorReport {
  bool took_over = false;
  double silent_s = 0.0;  ///< Of real time, when it took over.
  bool surfaced = false;  ///< As the depth sensor says.
};

/// Told in a sentence when something begins or ends.
using SupervisorLog = std::function<void(const std::string&)>;

/// Watches from the executive's first command until it has finished, or until the vehicle is at the
/// surface by this supervisor's doing; what `wanted` denies ends it as well.
[[nodiscard]] SupervisorReport supervise(const SupervisorSettings& settings, link::Bus& bus,
                                         Clock& clock, const SupervisorLog& log,
                                         const std::function<bool()>& wanted);

}  // namespace dive::mission
