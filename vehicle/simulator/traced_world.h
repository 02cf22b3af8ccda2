#pragma once
// The world as rays meet it (Embree): what the range camera and the stereo cameras share.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "planning/world/world.h"
#include "vehicle/convex_hull.h"

namespace dive::vehicle {

/// A plane of a solid half of space: the points x with normal . x = offset.
struct TracedPlane {
  Eigen::Vector3d normal;  ///< Unit, out of the solid half.
  double offset = 0.0;
};

/// Triangles, and which of them a ray meets first, from either side.
class TriangleScene {
 public:
  static constexpr int kPacket = 16;
  static constexpr std::uint32_t kNothing = ~0U;

  /// Neighbouring rays from one point, lane by lane.
  struct alignas(64) Packet {
    std::array<float, kPacket> dx;
    std::array<float, kPacket> dy;
    std::array<float, kPacket> dz;
    std::array<std::uint32_t, kPacket> triangle;  ///< Filled in; kNothing where none is met.
  };

  TriangleScene();
  TriangleScene(TriangleScene&&) noexcept;
  TriangleScene& operator=(TriangleScene&&) noexcept;
  ~TriangleScene();

  void add(std::span<const Eigen::Vector3d> vertices,
           std::span<const std::array<std::uint32_t, 3>> faces);
  void add(const TriangleSolid& solid);
  /// After the last add(), before the first ray.
  void build();

  [[nodiscard]] std::size_t size() const;
  /// Of one triangle, in the order in which they were added. Its normal points to either side; zero
  /// where the triangle has no area.
  [[nodiscard]] TracedPlane plane(std::size_t triangle) const;

  /// Along the unit vector d from o, within [near, far]; infinity: nothing.
  [[nodiscard]] double range(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double near,
                             double far) const;
  /// The first triangle along each of the first `count` rays from o, no farther than `far`.
  void trace(const Eigen::Vector3d& o, double far, int count, Packet& packet) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The faces of a convex solid, and a ball around it.
class ConvexInside {
 public:
  ConvexInside(const TriangleSolid& solid, const Eigen::Vector3d& middle);
  [[nodiscard]] bool contains(const Eigen::Vector3d& p) const;

 private:
  Eigen::Vector3d centre_;
  double radius_ = 0.0;
  std::vector<TracedPlane> faces_;
};

/// The surface of a bounded obstacle, where it stands.
[[nodiscard]] TriangleSolid placed_solid(const planning::Obstacle& obstacle);

/// Meshes as they were drawn, as long as the world has them, and not their convex pieces; curved
/// shapes as ClearanceMeter measures them; half-spaces as planes.
class TracedWorld {
 public:
  explicit TracedWorld(const planning::World& world);

  [[nodiscard]] const TriangleScene& triangles() const { return triangles_; }
  [[nodiscard]] const std::vector<TracedPlane>& planes() const { return planes_; }
  /// What each triangle belongs to, and each plane: the name in the world.
  [[nodiscard]] const std::string& name_of_triangle(std::size_t triangle) const;
  [[nodiscard]] const std::string& name_of_plane(std::size_t plane) const {
    return plane_names_[plane];
  }

  /// Whether a point lies inside of a solid or a half-space.
  [[nodiscard]] bool covers(const Eigen::Vector3d& p_W) const;
  /// To the nearest surface along the unit vector d from o, within [near, far]; infinity: none.
  [[nodiscard]] double range(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double near,
                             double far) const;

 private:
  void add(const planning::Obstacle& obstacle);

  TriangleScene triangles_;
  std::vector<ConvexInside> solids_;
  std::vector<TracedPlane> planes_;
  std::vector<std::string> names_;  // of runs of triangles ...
  std::vector<std::size_t> ends_;   // ... each up to here
  std::vector<std::string> plane_names_;
};

}  // namespace dive::vehicle
