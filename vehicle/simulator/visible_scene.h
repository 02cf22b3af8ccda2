#pragma once
// What each ray of a camera meets: a surface with its look, the water's surface from below, or
// nothing as far as one can see.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/se3.h"
#include "common/tag.h"
#include "planning/world/world.h"
#include "vehicle/simulator/ray_batch.h"
#include "vehicle/simulator/sky_light.h"
#include "vehicle/simulator/solid_texture.h"
#include "vehicle/simulator/tag_boards.h"
#include "vehicle/simulator/traced_world.h"

namespace dive::vehicle {

class VisibleScene {
 public:
  /// Which thing a ray has met, and with which face of it.
  using Ids = std::array<std::uint32_t, RayBatch::kSize>;
  static constexpr std::uint32_t kOpen = ~0U;
  static constexpr double kReach = 80.0;  ///< m: nothing farther is seen, in any water.

  explicit VisibleScene(const planning::World& world, std::span<const Tag> tags = {});

  /// Inside of something solid nothing is seen.
  [[nodiscard]] bool covers(const Eigen::Vector3d& p_W, const std::optional<Pose>& X_DW) const;
  [[nodiscard]] const SkyLight& sky() const { return sky_; }

  /// Fills in what the rays from o meet, all but the light; `radians_per_px` is a pixel's width in
  /// the middle of the picture. X_DW: of a diver who is in the water.
  void meet(const Eigen::Vector3d& o, double radians_per_px, const std::optional<Pose>& X_DW,
            RayBatch& rays, Ids& ids) const;
  /// Whether p lies in the plane of a thing met, within `tolerance` (m).
  [[nodiscard]] bool continues(std::uint32_t id, const Eigen::Vector3d& p_W,
                               double tolerance) const;

 private:
  // What is filled in of a face, packed.
  struct Face {
    float nx, ny, nz;
    float tone;
    std::int32_t look;
  };
  static Face face(const TracedPlane& plane, Look look, float tone);

  void find(const Eigen::Vector3d& o, const TriangleScene::Packet& packet, std::size_t first,
            std::size_t count, RayBatch& rays, Ids& ids) const;
  void fill(const Eigen::Vector3d& o, double radians_per_px, const Ids& ids, RayBatch& rays) const;
  static void fill_open(const Eigen::Vector3d& o, RayBatch& rays, std::size_t i);
  void add_boards(const Eigen::Vector3d& o, double radians_per_px, RayBatch& rays, Ids& ids) const;
  void add_diver(const Eigen::Vector3d& o, double radians_per_px, const Pose& X_DW, RayBatch& rays,
                 Ids& ids) const;

  TracedWorld traced_;
  std::vector<TracedPlane> face_planes_;  // of the triangles, then of the half-spaces
  std::vector<Face> faces_;
  TriangleScene diver_;
  ConvexInside diver_inside_;
  TagBoards boards_;
  SkyLight sky_;
};

}  // namespace dive::vehicle
