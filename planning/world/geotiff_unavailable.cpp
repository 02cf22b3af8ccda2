// In builds without GDAL instead of geotiff.cpp.

#include <fmt/format.h>

#include "planning/world/geotiff.h"

namespace dive::planning {

tl::expected<HeightGrid, std::string> read_geotiff(const std::string& path) {
  return tl::unexpected(
      fmt::format("it is a GeoTIFF, and this build of dive has no GDAL to read it: convert it with "
                  "gdal_translate -of AAIGrid {} grid.asc, or build dive where libgdal-dev is "
                  "installed",
                  path));
}

}  // namespace dive::planning
