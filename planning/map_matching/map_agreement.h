#pragma once
// Does one scan show the world that the map describes? A fix cannot tell: it uses the points that
// match, and over a flat seabed they match anywhere.
//
// Each ray is traced through the map and compared with its measured range. The results are counted
// by place, a cube with edges of a metre, so that a large surface counts for more than a small
// object close to the lens. Flat ground confirms nothing: it is the same everywhere.

#include "common/map_fix.h"
#include "common/range_scan.h"
#include "common/se3.h"
#include "planning/map_matching/map_surface.h"

namespace dive::planning {

/// The places of the scan, taken at X_WB in the map with an error of `sigma_m` (m) per horizontal
/// axis. A mapped surface is missing only where the scan sees through it from everywhere within two
/// sigmas: a ray that passes the edge of a deck at the vehicle's true position may meet that deck
/// at the estimated one.
[[nodiscard]] MapAgreement agreement(const MapSurface& surface, const RangeScan& scan,
                                     const Pose& X_WB, double sigma_m);

}  // namespace dive::planning
