#include "mission/simulation/appearing_obstacle.h"

#include <limits>

#include <fmt/format.h>

namespace dive::mission {
namespace {

using Eigen::Vector3d;

// Edge of a part, m: in any attitude its extent stays below that of a piece.
constexpr double kMaxEdge = 0.5 * planning::kMaxPieceExtent;

planning::Polytope box_at(const Pose& X_WO, const Vector3d& centre_O, const Vector3d& size) {
  planning::Polytope box;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d side((corner & 1) != 0 ? 0.5 : -0.5, (corner & 2) != 0 ? 0.5 : -0.5,
                        (corner & 4) != 0 ? 0.5 : -0.5);
    box.vertices.push_back(X_WO * (centre_O + side.cwiseProduct(size)));
  }
  return box;
}

std::vector<planning::Polytope> pieces_of(const AppearingObstacle& obstacle) {
  const Eigen::Array3i count = (obstacle.size.array() / kMaxEdge).ceil().max(1.0).cast<int>();
  const Vector3d size = obstacle.size.array() / count.cast<double>();
  std::vector<planning::Polytope> pieces;
  for (int x = 0; x < count.x(); ++x) {
    for (int y = 0; y < count.y(); ++y) {
      for (int z = 0; z < count.z(); ++z) {
        const Vector3d from_corner = Vector3d(x + 0.5, y + 0.5, z + 0.5).cwiseProduct(size);
        pieces.push_back(box_at(obstacle.X_WO, from_corner - 0.5 * obstacle.size, size));
      }
    }
  }
  return pieces;
}

}  // namespace

std::vector<planning::Obstacle> as_obstacles(std::span<const AppearingObstacle> appearing,
                                             std::size_t before) {
  std::vector<planning::Obstacle> obstacles;
  for (const AppearingObstacle& one : appearing) {
    obstacles.push_back({fmt::format("obstacle {}", ++before), planning::Box{one.size}, one.X_WO});
  }
  return obstacles;
}

planning::ObstacleUpdate as_update(std::span<const AppearingObstacle> appearing, std::size_t before,
                                   Utime now) {
  planning::ObstacleUpdate update{planning::ObstacleSource::kScript, now, {}};
  planning::CellKey key = std::numeric_limits<planning::CellKey>::min();
  key += static_cast<planning::CellKey>(before);
  for (const AppearingObstacle& one : appearing) {
    if (one.is_observed) update.cells.push_back({key, pieces_of(one)});
    ++key;
  }
  return update;
}

}  // namespace dive::mission
