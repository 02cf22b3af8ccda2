#pragma once
// Optical water types by the names that missions and commands use.

#include <optional>
#include <string>
#include <vector>

#include "vehicle/simulator/cameras/stereo_camera.h"

namespace dive::vehicle {

/// "clear_pool", "coastal_sea", "green_lake", "dark_wreck".
[[nodiscard]] const std::vector<std::string>& water_names();
/// The stereo pair in one of them, with the vehicle's lamps on where it is dark; empty for another
/// name.
[[nodiscard]] std::optional<StereoCameraOptions> stereo_camera_in(const std::string& water);

}  // namespace dive::vehicle
