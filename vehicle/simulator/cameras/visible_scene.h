#pragma once
// What each ray of a camera hits: a surface with its texture, the water's surface from below, or
// nothing within the visible range.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/se3.h"
#include "common/tag.h"
#include "planning/world/world.h"
#include "vehicle/simulator/cameras/solid_texture.h"
#include "vehicle/simulator/cameras/tag_boards.h"
#include "vehicle/simulator/ray_tracing/ray_batch.h"
#include "vehicle/simulator/ray_tracing/traced_world.h"
#include "vehicle/simulator/water/sky_light.h"

namespace dive::vehicle {

class VisibleScene {
 public:
  /// Object and face that a ray meets.
  using Ids = std::array<std::uint32_t, RayBatch::kSize>;
  static constexpr std::uint32_t kOpen = ~0U;
  static constexpr double kReach = 80.0;  ///< Maximum visible range in any water, m.

  explicit VisibleScene(const planning::World& world, std::span<const Tag> tags = {});

  /// True if the point lies inside a solid, where the image is black.
  [[nodiscard]] bool covers(const Eigen::Vector3d& p_W, const std::optional<Pose>& X_DW) const;
  [[nodiscard]] const SkyLight& sky() const { return sky_; }

  /// Writes what the rays from o meet, except the light; `radians_per_px` is a pixel's width in the
  /// centre of the image. X_DW: pose of W in the frame of a diver in the water.
  void meet(const Eigen::Vector3d& o, double radians_per_px, const std::optional<Pose>& X_DW,
            RayBatch& rays, Ids& ids) const;
  /// True if p lies in the plane of an object met, within `tolerance` (m).
  [[nodiscard]] bool continues(std::uint32_t id, const Eigen::Vector3d& p_W,
                               double tolerance) const;

 private:
  // Packed data of a face.
  struct Face {
    float nx, ny, nz;
    float tone;
    std::int32_t texture;
  };
  static Face face(const TracedPlane& plane, Texture texture, float tone);

  void find(const Eigen::Vector3d& o, const TriangleScene::Packet& packet, std::size_t first,
            std::size_t count, RayBatch& rays, Ids& ids) const;
  void fill(const Eigen::Vector3d& o, double radians_per_px, const Ids& ids, RayBatch& rays) const;
  static void fill_open(const Eigen::Vector3d& o, RayBatch& rays, std::size_t i);
  void add_boards(const Eigen::Vector3d& o, double radians_per_px, RayBatch& rays, Ids& ids) const;
  void add_diver(const Eigen::Vector3d& o, double radians_per_px, const Pose& X_DW, RayBatch& rays,
                 Ids& ids) const;

  TracedWorld traced_;
  std::vector<TracedPlane> face_planes_;  // planes of the triangles, then of the half-spaces
  std::vector<Face> faces_;
  TriangleScene diver_;
  ConvexInside diver_inside_;
  TagBoards boards_;
  SkyLight sky_;
};

}  // namespace dive::vehicle
