#pragma once
// Rates of a vertical ascent, m/s. An ascent lowers the commanded depth steadily; the vehicle
// follows with its depth loop, slower with a heavy trim or while it turns. Whoever commands an
// ascent, expects its duration or waits for its end uses these.

namespace dive::vehicle {

inline constexpr double kCommandedAscentRate = 0.25;
/// Expected of a vehicle, for how far it drifts meanwhile.
inline constexpr double kMeanAscentRate = 0.2;
/// Of the slowest, for how long to wait for the surface where depth is not measured.
inline constexpr double kSlowestAscentRate = 0.15;

}  // namespace dive::vehicle
