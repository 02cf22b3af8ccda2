#pragma once
// One cell of the map: ten by ten by ten voxels, and the pieces that stand for them. Internal.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "planning/world/seen.h"
#include "planning/world/world.h"

namespace dive::planning {

inline constexpr int kSide = 10;  ///< Voxels along the side of a cell.
inline constexpr int kMostEvidence = 6;

struct Voxel {
  Eigen::Vector3f p_W;  ///< Of what was seen in it.
  float noise = 0.0F;   ///< One sigma of it, m.
  Utime seen = 0;
  std::int16_t place = 0;    ///< In the cell.
  std::int8_t evidence = 0;  ///< Sweeps that saw it, less those that saw through it.
  bool solid = false;        ///< Believed.
  bool meshed = false;       ///< Part of the cell's surface.
};

/// A flat piece, to ask whether a point lies on it.
class Facet {
 public:
  explicit Facet(const Polytope& piece);
  /// Is the point within `tolerance` m of the piece (a little farther off its corners)?
  [[nodiscard]] bool holds(const Eigen::Vector3f& p_W, float tolerance) const;
  /// Signed distance from its plane; nothing when that is more than `reach`, or beside the piece.
  [[nodiscard]] std::optional<float> height(const Eigen::Vector3f& p_W, float reach) const;
  [[nodiscard]] const Eigen::Vector3f& normal() const { return normal_; }

 private:
  Eigen::Vector3f middle_;
  Eigen::Vector3f normal_ = Eigen::Vector3f::UnitZ();
  float around_ = 0.0F;  ///< Radius about the middle.
  float radius_ = 0.0F;
  struct Edge {
    Eigen::Vector3f outward;  ///< In the plane, unit.
    float offset;
  };
  std::vector<Edge> edges_;
};

struct Cell {
  std::vector<Voxel> voxels;
  std::vector<Polytope> surface;
  std::vector<Facet> facets;  ///< Of `surface`.
  Utime seen = 0;
  Utime stale_since = 0;  ///< Of a surface that does not fit the voxels any more; 0: it does.
  bool changed = false;   ///< Since the last update.

  Cell() { at_.fill(-1); }
  [[nodiscard]] Voxel* find(int place) {
    const std::int16_t at = at_[static_cast<std::size_t>(place)];
    return at < 0 ? nullptr : &voxels[static_cast<std::size_t>(at)];
  }
  Voxel& insert(int place);
  void erase(std::size_t index);
  [[nodiscard]] bool is_on_surface(const Eigen::Vector3f& p_W, float tolerance) const;
  /// The piece of the surface nearest to p_W, within `reach` m; null: there is none.
  [[nodiscard]] const Facet* nearest(const Eigen::Vector3f& p_W, float reach, float& height) const;
  /// Surface, and a ball for every believed voxel that is not part of it.
  [[nodiscard]] std::vector<Polytope> pieces(double ball_m) const;

 private:
  [[nodiscard]] Polytope everything() const;

  std::array<std::int16_t, kSide * kSide * kSide> at_;  ///< Index in `voxels`, or -1.
};

}  // namespace dive::planning
