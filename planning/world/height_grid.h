#pragma once
// The heights of a bathymetric grid, as the readers of its file formats give them.

#include <cstddef>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "planning/world/world.h"

namespace dive::planning {

inline constexpr std::size_t kMaxGridBytes = 16U << 20U;  ///< Of a file.

struct HeightGrid {
  std::size_t columns = 0;
  std::size_t rows = 0;
  double west = 0.0;   ///< x of the centres of the first column, m in W.
  double south = 0.0;  ///< y of the centres of the last row, m in W.
  double cell = 0.0;   ///< m.
  /// z in W, m, from north to south, each row from west to east; NaN where there is no data.
  std::vector<double> heights;
};

/// How to project a grid to metres: a clause with a command.
extern const char* const kProjectGrid;

/// Empty, or why a grid with these numbers of columns and rows and this size of cells (m) is not
/// accepted; a sentence.
[[nodiscard]] std::string grid_problem(double columns, double rows, double cell);

/// True if this can be a height on earth, m.
[[nodiscard]] bool is_height(double value);

/// The ground as triangles between the centres of the cells, facing up; without data z = 0. Error:
/// no cell has data.
[[nodiscard]] tl::expected<TriangleMesh, std::string> ground_of(const HeightGrid& grid);

}  // namespace dive::planning
