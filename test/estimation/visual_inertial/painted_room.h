#pragma once
// Images with a known truth: the inside of a box, painted with smooth noise, with drifting
// particles in it. Pinhole, distortion and texture are independent of the code under test.

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "common/random.h"
#include "common/se3.h"

namespace dive::estimation::testing {

struct Flake {
  Eigen::Vector3d p_W;  ///< Position at time 0, m.
  Eigen::Vector3d v_W;  ///< m/s.
};

class PaintedRoom {
 public:
  /// Extends from -half to half along each axis, m.
  explicit PaintedRoom(const Eigen::Vector3d& half, std::uint64_t seed = 1);

  /// Adds `count` particles, uniformly within `reach` (m) around p_W, of this speed (m/s).
  void snow(int count, const Eigen::Vector3d& p_W, double reach, double speed);

  /// The camera's image, with `noise` in grey levels, `light` times as bright.
  [[nodiscard]] ImageFrame image(const CameraModel& camera, const Pose& X_WC, Utime utime,
                                 double noise = 1.0, double light = 1.0);

  /// True if there is a particle within three pixels of n.
  [[nodiscard]] bool has_flake(const CameraModel& camera, const Pose& X_WC, Utime utime,
                               const Eigen::Vector2d& n) const;

  /// The point of the wall at normalised coordinates n.
  [[nodiscard]] Eigen::Vector3d wall_at(const Pose& X_WC, const Eigen::Vector2d& n) const;

 private:
  [[nodiscard]] double paint(const Eigen::Vector3d& p_W) const;

  Eigen::Vector3d half_;
  Random random_;
  std::vector<Flake> flakes_;
  std::vector<float> table_;
};

/// Approximately EuRoC's left camera; X_BC: x forward in B, moved by `y` (m) to the left.
[[nodiscard]] CameraModel test_camera(double y = 0.0);

/// The same without distortion and of another size; f in pixels.
[[nodiscard]] CameraModel pinhole_camera(double y, int width, int height, double f);

/// An ideal equidistant lens, 120 degrees across: 120 x 90 degrees where the sides are as 4 to 3.
[[nodiscard]] CameraModel wide_camera(double y, int width, int height);

/// Optical axis along x of B.
[[nodiscard]] Eigen::Quaterniond looking_ahead();

/// [x/z, y/z] of a point in the camera; empty for one behind it.
[[nodiscard]] std::optional<Eigen::Vector2d> seen_at(const Pose& X_WC, const Eigen::Vector3d& p_W);

/// Pixels, by the formulas of the ASL format, or through an ideal equidistant lens.
[[nodiscard]] Eigen::Vector2d pixel_of(const CameraModel& camera, const Eigen::Vector2d& n);

}  // namespace dive::estimation::testing
