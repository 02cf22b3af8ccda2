#pragma once
// One cell of the map: ten by ten by ten voxels, and the pieces that represent them. Internal.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "planning/world/obstacle_update.h"
#include "planning/world/world.h"

namespace dive::planning {

inline constexpr int kSide = 10;  ///< Number of voxels along the side of a cell.
inline constexpr int kMaxEvidence = 6;

struct Voxel {
  Eigen::Vector3f p_W;  ///< Position of the points observed in the voxel.
  float noise = 0.0F;   ///< Standard deviation of that position, m.
  Utime last_observed = 0;
  std::int16_t place = 0;  ///< Index of the voxel in the cell.
  /// Number of scans that hit the voxel, minus those that passed through it.
  std::int8_t evidence = 0;
  bool confirmed = false;  ///< True if the voxel is confirmed as occupied.
  bool meshed = false;     ///< True if the voxel is part of the cell's surface.
};

/// A flat piece, to test whether a point lies on it.
class Facet {
 public:
  explicit Facet(const Polytope& piece);
  /// True if the point is within `tolerance` m of the piece (a little farther off its corners).
  [[nodiscard]] bool contains(const Eigen::Vector3f& p_W, float tolerance) const;
  /// Signed distance from its plane; absent if that is more than `reach`, or beside the piece.
  [[nodiscard]] std::optional<float> height(const Eigen::Vector3f& p_W, float reach) const;
  [[nodiscard]] const Eigen::Vector3f& normal() const { return normal_; }

 private:
  Eigen::Vector3f middle_;
  Eigen::Vector3f normal_ = Eigen::Vector3f::UnitZ();
  float around_ = 0.0F;  ///< Radius about the middle, m.
  float radius_ = 0.0F;
  struct Edge {
    Eigen::Vector3f outward;  ///< Outward unit vector in the plane.
    float offset;
  };
  std::vector<Edge> edges_;
};

struct Cell {
  std::vector<Voxel> voxels;
  std::vector<Polytope> surface;
  std::vector<Facet> facets;  ///< Facets of `surface`.
  Utime last_observed = 0;
  Utime stale_since = 0;  ///< Time since which the surface no longer fits the voxels; 0 if it fits.
  bool changed = false;   ///< True if changed since the last update.

  Cell() { at_.fill(-1); }
  [[nodiscard]] Voxel* find(int place) {
    const std::int16_t at = at_[static_cast<std::size_t>(place)];
    return at < 0 ? nullptr : &voxels[static_cast<std::size_t>(at)];
  }
  Voxel& insert(int place);
  void erase(std::size_t index);
  [[nodiscard]] bool is_on_surface(const Eigen::Vector3f& p_W, float tolerance) const;
  /// The piece of the surface nearest to p_W, within `reach` m; null if there is none.
  [[nodiscard]] const Facet* nearest(const Eigen::Vector3f& p_W, float reach, float& height) const;
  /// The surface, and a ball for every confirmed voxel that is not part of it.
  [[nodiscard]] std::vector<Polytope> pieces(double ball_m) const;

 private:
  [[nodiscard]] Polytope everything() const;

  std::array<std::int16_t, std::size_t{kSide} * kSide * kSide> at_;  ///< Index in `voxels`, or -1.
};

}  // namespace dive::planning
