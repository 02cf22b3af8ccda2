#pragma once
// The world for ray tracing (Embree), shared by the range camera and the stereo cameras.

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

/// A plane that bounds a solid half-space: the points x with normal . x = offset.
struct TracedPlane {
  Eigen::Vector3d normal;  ///< Unit normal out of the solid half-space.
  double offset = 0.0;
};

/// Triangles, and the query for the first one along a ray, from either side.
class TriangleScene {
 public:
  static constexpr int kPacket = 16;
  static constexpr std::uint32_t kNothing = ~0U;

  /// Neighbouring rays from one point, lane by lane.
  struct alignas(64) Packet {
    std::array<float, kPacket> dx;
    std::array<float, kPacket> dy;
    std::array<float, kPacket> dz;
    std::array<std::uint32_t, kPacket> triangle;  ///< Output; kNothing if none is met.
  };

  TriangleScene();
  TriangleScene(TriangleScene&&) noexcept;
  TriangleScene& operator=(TriangleScene&&) noexcept;
  ~TriangleScene();

  void add(std::span<const Eigen::Vector3d> vertices,
           std::span<const std::array<std::uint32_t, 3>> faces);
  void add(const TriangleSolid& solid);
  /// Called after the last add() and before the first ray.
  void build();

  [[nodiscard]] std::size_t size() const;
  /// Plane of one triangle, in the order of add(). Its normal points to either side; zero if the
  /// triangle has no area.
  [[nodiscard]] TracedPlane plane(std::size_t triangle) const;

  /// Range along the unit vector d from o, within [near, far]; infinity: nothing.
  [[nodiscard]] double range(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double near,
                             double far) const;
  /// The first triangle along each of the first `count` rays from o, no farther than `far`.
  void trace(const Eigen::Vector3d& o, double far, int count, Packet& packet) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A convex solid for inside tests: its faces, and a ball around it.
class ConvexInside {
 public:
  ConvexInside(const TriangleSolid& solid, const Eigen::Vector3d& middle);
  [[nodiscard]] bool contains(const Eigen::Vector3d& p) const;

 private:
  Eigen::Vector3d centre_;
  double radius_ = 0.0;
  std::vector<TracedPlane> faces_;
};

/// The surface of a bounded obstacle at its pose in W.
[[nodiscard]] TriangleSolid placed_solid(const planning::Obstacle& obstacle);

/// Meshes as drawn, as long as the world has them, not by their convex pieces; curved shapes as in
/// ClearanceMeter; half-spaces as planes.
class TracedWorld {
 public:
  explicit TracedWorld(const planning::World& world);

  [[nodiscard]] const TriangleScene& triangles() const { return triangles_; }
  [[nodiscard]] const std::vector<TracedPlane>& planes() const { return planes_; }
  /// Name in the world of the obstacle that a triangle or plane belongs to.
  [[nodiscard]] const std::string& name_of_triangle(std::size_t triangle) const;
  [[nodiscard]] const std::string& name_of_plane(std::size_t plane) const {
    return plane_names_[plane];
  }

  /// True if a point lies inside a solid or a half-space.
  [[nodiscard]] bool covers(const Eigen::Vector3d& p_W) const;
  /// Distance to the nearest surface along the unit vector d from o, within [near, far]; infinity:
  /// none.
  [[nodiscard]] double range(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double near,
                             double far) const;

 private:
  void add(const planning::Obstacle& obstacle);

  TriangleScene triangles_;
  std::vector<ConvexInside> solids_;
  std::vector<TracedPlane> planes_;
  std::vector<std::string> names_;  // names of runs of triangles
  std::vector<std::size_t> ends_;   // end of each run of triangles
  std::vector<std::string> plane_names_;
};

}  // namespace dive::vehicle
