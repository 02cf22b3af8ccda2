#include "planning/mapping/cell_grid.h"

#include <cmath>
#include <utility>

#include "planning/mapping/voxel_cell.h"

namespace dive::planning {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr int kMaxCellIndex = 1 << 20;  // in cells from the origin: a thousand kilometres
constexpr int kMaxVoxelIndex = kMaxCellIndex * kSide / 2;

}  // namespace

CellKey key_of(const Vector3i& cell) {
  const auto part = [](int c) { return static_cast<CellKey>(c + kMaxCellIndex); };
  return part(cell.x()) << 42 | part(cell.y()) << 21 | part(cell.z());
}

Vector3i cell_of(CellKey key) {
  const auto part = [](CellKey bits) {
    return static_cast<int>(bits & ((CellKey{1} << 21) - 1)) - kMaxCellIndex;
  };
  return {part(key >> 42), part(key >> 21), part(key)};
}

CellGrid::CellGrid(float voxel_m)
    : voxel_m_(voxel_m), cell_m_(voxel_m * static_cast<float>(kSide)) {}

std::optional<CellGrid::Place> CellGrid::locate(const Vector3f& p_W) const {
  const Vector3f at = p_W / voxel_m_;
  if (!(at.cwiseAbs().maxCoeff() < static_cast<float>(kMaxVoxelIndex))) {
    return std::nullopt;
  }
  const Vector3i v(static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y())),
                   static_cast<int>(std::floor(at.z())));
  const auto split = [](int c) {
    const int cell = c >= 0 ? c / kSide : -((kSide - 1 - c) / kSide);
    return std::pair(cell, c - cell * kSide);
  };
  const auto [cx, x] = split(v.x());
  const auto [cy, y] = split(v.y());
  const auto [cz, z] = split(v.z());
  return Place{key_of({cx, cy, cz}), (x * kSide + y) * kSide + z};
}

}  // namespace dive::planning
