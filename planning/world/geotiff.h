#pragma once
// Bathymetric grids as GeoTIFF, read by GDAL, which is optional: cmake finds its headers or not,
// and its library is loaded when the first such grid is read (doc/decisions/gdal-when-needed.md).

#include <string>

#include <tl/expected.hpp>

#include "planning/world/height_grid.h"

namespace dive::planning {

/// The heights in the only band of the file: metres above z = 0, in cells that are square, with
/// rows from west to east, in a projection in metres or without one. Cells that are masked or hold
/// the no-data value have none. Only the file itself is read, no .aux.xml or .tfw beside it.
/// Errors, as sentences: this build or this computer has no GDAL, no GeoTIFF, another band, unit,
/// axis or projection, more than kMaxGridCells, no heights.
[[nodiscard]] tl::expected<HeightGrid, std::string> read_geotiff(const std::string& path);

}  // namespace dive::planning
