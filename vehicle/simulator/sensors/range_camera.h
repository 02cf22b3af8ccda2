#pragma once
// A simulated range camera, by tracing a ray per pixel (Embree). Only the simulator has the world;
// in an unknown environment the vehicle has only these scans.
//
// Its pixels are those of common/range_view.h. Mounted midway between the links camera_front_left
// and camera_front_right of vehicle/aqua2.urdf, tilted down: p_BC = origin_B, R_BC = Ry(tilt_deg),
// and turned by misalignment_deg in the mount.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/clock.h"
#include "common/range_scan.h"
#include "common/range_view.h"
#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::vehicle {

struct RangeCameraOptions : RangeView {
  int width = 100;
  int height = 75;
  /// Roll, pitch and yaw by which the camera is turned in its mount, deg; its points are reported
  /// as if it were not.
  Eigen::Vector3d misalignment_deg = Eigen::Vector3d::Zero();
  double rate_hz = 10.0;
  /// Standard deviation of a range: noise_m + noise_share * range.
  double noise_m = 0.01;
  double noise_share = 0.005;
  double dropout_share = 0.02;     ///< Fraction of the pixels of a scan without a range.
  double particles_per_m3 = 0.5;   ///< Marine snow within 3 m of the lens along each axis of W.
  double particle_radius = 0.004;  ///< m
  double particle_drift = 0.05;    ///< Speed of each particle in its own direction, m/s.

  /// A description of the first error; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
};

/// The options with the misalignment of one vehicle, each angle drawn with `sigma_deg` (deg).
[[nodiscard]] RangeCameraOptions drawn_range_camera(RangeCameraOptions options, double sigma_deg,
                                                    std::uint64_t seed);

/// Equal world, options, seed and calls of take() give bit-identical scans.
class RangeCamera {
 public:
  /// Demands options that validate. Meshes are traced as drawn, as long as the world has them, from
  /// either side, not by their convex pieces; curved shapes as in ClearanceMeter.
  RangeCamera(const planning::World& world, RangeCameraOptions options, std::uint64_t seed);
  RangeCamera(RangeCamera&&) noexcept;
  RangeCamera& operator=(RangeCamera&&) noexcept;
  ~RangeCamera();

  /// Adds obstacles to the world from now on.
  void add(const planning::World& appeared);

  /// True if a scan is due: rate_hz times a second from 0 on.
  [[nodiscard]] bool due(Utime now) const;

  /// Takes one scan at a finite pose; X_WD: pose of a Diver in the water. Always width * height
  /// points, row by row from the top, each row from the left; in the present B.
  ///
  /// A pixel returns the nearest surface on its ray, or a particle before it whose image, grown by
  /// half a pixel's width all round, covers the centre of the pixel. If there is nothing within
  /// `reach`, or the ray leaves the water (z = 0) before, the point is at twice the reach: objects
  /// above the surface are invisible. NaN: dropouts; every pixel while the lens is inside a solid,
  /// a half-space or the diver; and, with the lens above the water, pixels that point up or whose
  /// ray does not reach the water.
  [[nodiscard]] RangeScan take(Utime now, const Pose& X_WB,
                               const std::optional<Pose>& X_WD = std::nullopt);

  /// Repeats the next scan with new stamps until set to false.
  void set_frozen(bool frozen);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::vehicle
