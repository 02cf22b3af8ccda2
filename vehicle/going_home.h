#pragma once
// Rules for the way home that the behaviours retrace and surface, the executive and ExitGuidance
// have in common.

namespace dive::vehicle {

/// Distance at which a waypoint of the way home counts as reached, m.
inline constexpr double kHomeCaptureRadius = 0.5;

/// Time after which a vehicle that stops is at rest, s. A retrace, which swims on, waits for 4 s.
inline constexpr double kComesToRest = 5.0;
/// One sigma of the speed that is left when it has stopped, because the vehicle is not quite that
/// of the motion model, m/s. It decays slowly: half of it is left after half a minute.
inline constexpr double kStopSigma = 0.03;

/// Commanded depth of an ascent without depth samples, m: the effort stays upwards at the surface.
inline constexpr double kAboveSurface = -1.0;
/// Duration of such an ascent from `depth_m` at `rate` (m/s), s: twice the expected one, and more.
/// The behaviour surface takes the rate that it commands otherwise, ExitGuidance the slowest.
[[nodiscard]] constexpr double blind_ascent_s(double depth_m, double rate) {
  return 2.0 * depth_m / rate + 10.0;
}

// A vehicle above these depths (m) is at the surface. What ends a mission's ascent is the least, so
// that the others find it there in spite of an error of the depth sensor:
inline constexpr double kSurfacedDepth = 0.25;  ///< Ends the ascent of the behaviour surface.
inline constexpr double kSurfaceDepth = 0.3;    ///< By ExitGuidance and the simulated vehicle.
inline constexpr double kCheckedSurfacedDepth = 0.5;  ///< By `dive check`, at the end of a dive.

}  // namespace dive::vehicle
