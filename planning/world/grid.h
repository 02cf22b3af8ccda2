#pragma once
// Bathymetric grids: GeoTIFF (geotiff.h) and ESRI ASCII (.asc), as GIS and survey programs write
// them. ESRI ASCII:
//
//   ncols 3
//   nrows 2
//   xllcorner -10       west edge (or xllcenter: the centre of the south-west cell)
//   yllcorner 0
//   cellsize 2
//   NODATA_value -9999  optional
//   -12.1 -12.0 -11.8   from north to south, each row from west to east
//   -12.3 -9999 -12.0

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "common/source_text.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Limit of the cells of a grid: with noise, each becomes two convex pieces.
inline constexpr std::size_t kMaxGridCells = 250'000;

/// True if a file that begins with these bytes is a grid, well-formed or not.
[[nodiscard]] bool begins_like_grid(std::string_view head);

/// The same of a file, which may begin with blanks.
[[nodiscard]] bool is_grid(const std::string& path);

/// The ground as triangles between the centres of the cells, facing up. Coordinates are metres in
/// W, values z in W: negative under water. A cell without data is solid up to the surface (z = 0),
/// so that no path leads where the ground is not known. Errors, of ESRI ASCII with the line: no
/// grid, more than kMaxGridCells, values that are missing or no heights, a cell size in degrees, no
/// cell with data.
[[nodiscard]] tl::expected<TriangleMesh, std::string> read_grid(const std::string& path);

/// The map (SDF) that consists of this grid, with the path of the grid.
[[nodiscard]] SourceText grid_as_map(const std::string& path);

}  // namespace dive::planning
