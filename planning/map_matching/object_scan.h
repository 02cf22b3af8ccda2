#pragma once
// Does one scan see through the objects of the known map? Objects are observed one by one and cell
// by cell, with every ray of the scan: a pipe is thinner than the distance between the rays by
// which map_agreement.h compares map and scan.
//
// A ray passes through a cell if it meets the object there and its measured range ends clear of the
// object. No single ray counts: the vehicle's true position differs from the estimated one, and a
// ray that misses a pipe by a hand's breadth passes through the pipe at the estimated position. But
// then other rays of the scan meet it, close to where the map has it. So a cell is free only if
// several rays pass through it and none of the whole scan ends near it.

#include <cstdint>
#include <vector>

#include "common/range_scan.h"
#include "common/se3.h"
#include "planning/map_matching/map_surface.h"
#include "planning/map_matching/object_cells.h"

namespace dive::planning {

/// What one scan shows of one cell.
struct CellSighting {
  std::int32_t object = 0;  ///< Index in ObjectCells::objects().
  std::int32_t cell = 0;
  /// False: something is where the map has the object, and no other object of the map explains it.
  bool is_free = false;
};

/// The cells that the scan, taken at X_WB in the map with an error of `sigma_m` (m) per horizontal
/// axis, shows free or occupied; of all others it says nothing. Ascending by object and cell. A ray
/// without a return proves nothing.
[[nodiscard]] std::vector<CellSighting> observe_objects(const MapSurface& surface,
                                                        const ObjectCells& objects,
                                                        const RangeScan& scan, const Pose& X_WB,
                                                        double sigma_m);

}  // namespace dive::planning
