#pragma once
// Surfaces the vehicle when the executive has stopped or hangs: it monitors the executive's
// commands, and when they stop it commands the vehicle's own autopilot to the surface until it is
// there. Small on purpose: it uses no mission, no map and no plan.

#include <functional>
#include <string>

#include "common/clock.h"
#include "vehicle/link/bus.h"

namespace dive::mission {

struct SupervisorSettings {
  double command_timeout_s = 1.0;  ///< Maximum silence after the executive's first command.
};

struct SupervisorReport {
  bool took_over = false;
  double silent_s = 0.0;  ///< Real time of silence at the takeover.
  bool surfaced = false;  ///< By the depth sensor.
};

/// Called with a sentence at the start and end of each phase.
using SupervisorLog = std::function<void(const std::string&)>;

/// Monitors from the executive's first command until it has finished, or until this supervisor has
/// brought the vehicle to the surface; also ends when `wanted` returns false.
[[nodiscard]] SupervisorReport supervise(const SupervisorSettings& settings, link::Bus& bus,
                                         Clock& clock, const SupervisorLog& log,
                                         const std::function<bool()>& wanted);

}  // namespace dive::mission
