#pragma once
// The fraction of the daylight that reaches a point: under water it arrives through Snell's window,
// the cone of 48.6 degrees about the zenith, and objects in that cone cast shadows.
//
// Measured once, at the corners of a grid over everything bounded, along nine rays of which each
// stands for the same share of the light; interpolated between the corners. Shadows have the grid's
// softness, 0.4 m or more.

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vehicle/simulator/ray_tracing/ray_batch.h"
#include "vehicle/simulator/ray_tracing/traced_world.h"

namespace dive::vehicle {

class SkyLight {
 public:
  SkyLight(const TracedWorld& traced, const Eigen::AlignedBox3d& bounds);

  /// The fraction at a point, from 0, dark, to 1, open.
  [[nodiscard]] float at(const Eigen::Vector3d& p_W) const;
  /// Writes `sky` at the points met from a lens at o; evaluated slightly before the surface,
  /// because light behind it does not count. 1 where nothing is met.
  void fill(const Eigen::Vector3d& o, RayBatch& rays) const;

 private:
  struct Grid;
  void measure(const TracedWorld& traced);

  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  double cell_ = 0.4;  // m
  std::array<int, 3> corners_{};
  std::vector<float> open_;  // fraction at the corners, x fastest; empty: all open
};

}  // namespace dive::vehicle
