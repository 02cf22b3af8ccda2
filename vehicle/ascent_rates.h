#pragma once
// Rates of a vertical ascent, m/s. An ascent lowers the commanded depth at a constant rate; the
// vehicle lags behind, more so while it turns or if it is negatively buoyant. Code that commands
// an ascent, predicts its duration, or times it out takes its rate from here.

namespace dive::vehicle {

inline constexpr double kCommandedAscentRate = 0.25;
/// Typical of the vehicle: for how far it drifts meanwhile.
inline constexpr double kMeanAscentRate = 0.2;
/// Of the slowest ascent: for how long to wait for the surface if depth is not measured.
inline constexpr double kSlowestAscentRate = 0.15;

}  // namespace dive::vehicle
