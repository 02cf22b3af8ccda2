#include "planning/map_matching/object_cells.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "planning/world/primitives.h"

namespace dive::planning {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kMaxExtent = 10.0;  // m
constexpr double kFlat = 3.0;        // horizontal extents of ground, in its heights
constexpr std::size_t kMaxCells = 400;
constexpr int kSamples = 5;  // of a cell, along each axis
constexpr double kPitch = ObjectCells::kEdge / kSamples;
const double kHalfDiagonal = 0.5 * std::sqrt(3.0);  // of a cube, in its edges

bool may_be_missing(const AlignedBox3d& box) {
  const Vector3d extent = box.sizes();
  return extent.maxCoeff() <= kMaxExtent && extent.head<2>().minCoeff() <= kFlat * extent.z();
}

}  // namespace

ObjectCells::ObjectCells(const World& world, const MapSurface& surface) {
  const int size = static_cast<int>(world.obstacles.size());
  for (ObjectRange range; range.first < size; range.first = range.end) {
    range = object_at(world, range.first);
    Object object;
    object.obstacles = range;
    bool is_bounded = true;
    for (int i = range.first; i < range.end; ++i) {
      const Obstacle& obstacle = world.obstacles[static_cast<std::size_t>(i)];
      is_bounded &= !std::holds_alternative<HalfSpace>(obstacle.shape);
      if (is_bounded) object.box.extend(bounding_box(obstacle));
    }
    if (!is_bounded || !may_be_missing(object.box)) continue;
    divide(surface, object);
    if (!object.cells.empty() && object.cells.size() <= kMaxCells) {
      objects_.push_back(std::move(object));
    }
  }
}

// Points of a grid that the surface passes stand for it.
void ObjectCells::divide(const MapSurface& surface, Object& object) {
  object.count_ = (object.box.sizes() / kEdge).array().ceil().max(1.0).cast<int>();
  object.cell_of_place_.assign(static_cast<std::size_t>(object.count_.prod()), -1);
  const auto is_passed = [&](const Vector3d& centre_W, double edge) {
    const double reach = kHalfDiagonal * edge;
    return std::abs(surface.distance(object.obstacles.first, centre_W, reach)) < reach;
  };
  for (std::size_t place = 0; place < object.cell_of_place_.size(); ++place) {
    const int at = static_cast<int>(place);
    const Eigen::Vector3i index(at % object.count_.x(), at / object.count_.x() % object.count_.y(),
                                at / (object.count_.x() * object.count_.y()));
    const Vector3d low = object.box.min() + kEdge * index.cast<double>();
    if (!is_passed(low + Vector3d::Constant(0.5 * kEdge), kEdge)) continue;
    AlignedBox3d cell;
    for (int i = 0; i < kSamples * kSamples * kSamples; ++i) {
      const Eigen::Vector3i sample(i % kSamples, i / kSamples % kSamples,
                                   i / (kSamples * kSamples));
      const Vector3d centre = low + kPitch * (sample.cast<double>() + Vector3d::Constant(0.5));
      if (!is_passed(centre, kPitch)) continue;
      cell.extend(centre - Vector3d::Constant(0.5 * kPitch));
      cell.extend(centre + Vector3d::Constant(0.5 * kPitch));
    }
    if (cell.isEmpty()) continue;
    object.cell_of_place_[place] = static_cast<int>(object.cells.size());
    object.cells.push_back(cell);
  }
}

std::optional<int> ObjectCells::Object::cell_at(const Vector3d& p_W) const {
  const Eigen::Array3i last = count_.array() - 1;
  const Eigen::Array3d steps = ((p_W - box.min()) / kEdge).array().floor();
  const Eigen::Array3i index = steps.max(0.0).min(last.cast<double>()).cast<int>();
  const int place = index.x() + count_.x() * (index.y() + count_.y() * index.z());
  const int cell = cell_of_place_[static_cast<std::size_t>(place)];
  if (cell < 0) return std::nullopt;
  return cell;
}

}  // namespace dive::planning
