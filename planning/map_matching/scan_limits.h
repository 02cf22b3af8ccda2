#pragma once
// What of a scan is compared with the known map. Private to this folder.

namespace dive::planning {

inline constexpr double kMinRange = 0.3;  ///< m: nearer is the vehicle itself, or marine snow.
inline constexpr double kMaxRange =
    8.0;  ///< m: beyond, an error of the attitude moves a ray too far.
inline constexpr double kRangeShare = 0.02;  ///< Error of a range, as its share.
inline constexpr double kSigmas = 2.0;  ///< Standard deviations of the position that are tolerated.

}  // namespace dive::planning
