#pragma once
// What a range camera sees of the world, by tracing a ray per pixel (Embree). Only the simulator
// knows the world; a vehicle in unknown water knows nothing but these scans.
//
// Pinhole: the grid of pixels is uniform on the image plane. In the camera's frame C (x along the
// optical axis, y left, z up) the pixel in column c and row r looks along
//
//   [1, tan(horizontal / 2) (1 - 2 (c + 1/2) / width), tan(vertical / 2) (1 - 2 (r + 1/2) /
//   height)]
//
// Mounted midway between the links camera_front_left and camera_front_right of vehicle/aqua2.urdf,
// tilted down: p_BC = origin_B, R_BC = Ry(tilt_deg).

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/clock.h"
#include "common/range_scan.h"
#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::vehicle {

struct RangeCameraOptions {
  int width = 100;
  int height = 75;
  double horizontal_deg = 120.0;
  double vertical_deg = 90.0;
  double tilt_deg = 40.0;  ///< Of the optical axis below x of B.
  Eigen::Vector3d origin_B = {0.31, 0.0, 0.0};
  double reach_m = 10.0;
  double rate_hz = 10.0;
  /// Standard deviation of a range: noise_m + noise_share * range.
  double noise_m = 0.01;
  double noise_share = 0.005;
  double dropout_share = 0.02;     ///< Of the pixels of a scan that tell nothing.
  double particles_per_m3 = 0.5;   ///< Marine snow, within 3 m of the lens along each axis of W.
  double particle_radius = 0.004;  ///< m
  double particle_drift = 0.05;    ///< m/s, in a direction of its own for each.

  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
};

/// Same world, options and seed, same calls of take(): the same scans, bit for bit.
class RangeCamera {
 public:
  /// Demands options that validate. Meshes are seen as they were drawn, as long as the world has
  /// them, from either side, and not by their convex pieces; curved shapes as ClearanceMeter
  /// measures them.
  RangeCamera(const planning::World& world, RangeCameraOptions options, std::uint64_t seed);
  RangeCamera(RangeCamera&&) noexcept;
  RangeCamera& operator=(RangeCamera&&) noexcept;
  ~RangeCamera();

  /// Whether a scan falls due, rate_hz times a second from 0 on.
  [[nodiscard]] bool due(Utime now) const;

  /// One scan at a finite pose; X_WD: that of a Diver who is in the water. Always width * height
  /// points, row by row from the top, each row from the left; in B as it is now.
  ///
  /// A pixel returns the nearest surface on its ray. A particle before that whose image, grown by
  /// half a pixel's width all round, covers the middle of the pixel is returned instead. Where
  /// there is nothing as far as `reach`, and where the ray leaves the water (z = 0) before, the
  /// point is at twice the reach: what stands out of the water is not seen. NaN: dropouts; every
  /// pixel while the lens is inside a solid, a half-space or the diver; and with the lens above the
  /// water those that look up, or that reach no water.
  [[nodiscard]] RangeScan take(Utime now, const Pose& X_WB,
                               const std::optional<Pose>& X_WD = std::nullopt);

  /// Until told otherwise the next scan is returned again and again, with new stamps.
  void set_frozen(bool frozen);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::vehicle
