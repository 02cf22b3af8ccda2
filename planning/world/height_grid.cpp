#include "planning/world/height_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include "planning/world/grid.h"

namespace dive::planning {
namespace {

constexpr double kMaxElevation = 12'000.0;  // m, of anything on earth
constexpr double kMinCell = 0.01;           // m; smaller ones are degrees

// Counter-clockwise from above; rows go south.
void add_triangles(const HeightGrid& grid, TriangleMesh& mesh) {
  const auto at = [&](std::size_t row, std::size_t column) {
    return static_cast<std::uint32_t>(row * grid.columns + column);
  };
  for (std::size_t row = 0; row + 1 < grid.rows; ++row) {
    for (std::size_t column = 0; column + 1 < grid.columns; ++column) {
      const std::uint32_t north_west = at(row, column);
      const std::uint32_t north_east = at(row, column + 1);
      const std::uint32_t south_west = at(row + 1, column);
      const std::uint32_t south_east = at(row + 1, column + 1);
      mesh.triangles.push_back({north_west, south_west, north_east});
      mesh.triangles.push_back({north_east, south_west, south_east});
    }
  }
}

}  // namespace

const char* const kProjectGrid =
    "project the grid to metres about the origin, as with gdalwarp -t_srs \"+proj=ortho "
    "+lat_0=... +lon_0=...\"";

std::string grid_problem(double columns, double rows, double cell) {
  const auto is_count = [](double value) {
    return value >= 2.0 && value <= static_cast<double>(kMaxGridCells) &&
           value == std::floor(value);
  };
  if (!is_count(columns) || !is_count(rows)) {
    return "the numbers of columns and rows (ncols, nrows) must be whole numbers of at least 2";
  }
  if (columns * rows > static_cast<double>(kMaxGridCells)) {
    return fmt::format(
        "the grid has {:.0f} cells, and {} can be handled: cut out the area of the dive, or use "
        "larger cells",
        columns * rows, kMaxGridCells);
  }
  if (cell >= kMinCell) return {};
  return fmt::format("a cell size of {:g} is in degrees: {}", cell, kProjectGrid);
}

bool is_height(double value) { return std::abs(value) <= kMaxElevation; }

tl::expected<TriangleMesh, std::string> ground_of(const HeightGrid& grid) {
  const auto is_unknown = [](double height) { return std::isnan(height); };
  if (std::ranges::all_of(grid.heights, is_unknown)) {
    return tl::unexpected(std::string("no cell of the grid has data"));
  }
  TriangleMesh mesh;
  mesh.vertices.reserve(grid.heights.size());
  for (std::size_t i = 0; i < grid.heights.size(); ++i) {
    const std::size_t row = i / grid.columns;
    const std::size_t column = i % grid.columns;
    mesh.vertices.emplace_back(grid.west + static_cast<double>(column) * grid.cell,
                               grid.south + static_cast<double>(grid.rows - 1 - row) * grid.cell,
                               is_unknown(grid.heights[i]) ? 0.0 : grid.heights[i]);
  }
  add_triangles(grid, mesh);
  return mesh;
}

}  // namespace dive::planning
