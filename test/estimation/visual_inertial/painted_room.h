#pragma once
// Pictures whose truth is known: the inside of a box, painted with smooth noise, with flakes that
// drift in it. Its own pinhole, distortion and texture; nothing of what is tested.

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "common/random.h"
#include "common/se3.h"

namespace dive::estimation::testing {

struct Flake {
  Eigen::Vector3d p_W;  ///< At time 0, m.
  Eigen::Vector3d v_W;  ///< m/s.
};

class PaintedRoom {
 public:
  /// From -half to half along each axis, m.
  explicit PaintedRoom(const Eigen::Vector3d& half, std::uint64_t seed = 1);

  /// So many flakes, uniformly within `reach` (m) around p_W, of such a speed (m/s).
  void snow(int count, const Eigen::Vector3d& p_W, double reach, double speed);

  /// What the camera sees, with noise of so many grey levels, `light` times as bright.
  [[nodiscard]] ImageFrame picture(const CameraModel& camera, const Pose& X_WC, Utime utime,
                                   double noise = 1.0, double light = 1.0);

  /// Whether there is a flake within three pixels of n.
  [[nodiscard]] bool has_flake(const CameraModel& camera, const Pose& X_WC, Utime utime,
                               const Eigen::Vector2d& n) const;

  /// Where the wall is that is seen at normalised coordinates n.
  [[nodiscard]] Eigen::Vector3d wall_at(const Pose& X_WC, const Eigen::Vector2d& n) const;

 private:
  [[nodiscard]] double paint(const Eigen::Vector3d& p_W) const;

  Eigen::Vector3d half_;
  Random random_;
  std::vector<Flake> flakes_;
  std::vector<float> table_;
};

/// Of EuRoC's left camera, about; X_BC: x forward in B, moved by `y` (m) to the left.
[[nodiscard]] CameraModel test_camera(double y = 0.0);

/// The same without distortion and of another size; f in pixels.
[[nodiscard]] CameraModel pinhole_camera(double y, int width, int height, double f);

/// Looking along x of B.
[[nodiscard]] Eigen::Quaterniond looking_ahead();

/// [x/z, y/z] of a point in the camera; nothing for one behind it.
[[nodiscard]] std::optional<Eigen::Vector2d> seen_at(const Pose& X_WC, const Eigen::Vector3d& p_W);

/// Pixels, by the formulas of the ASL format.
[[nodiscard]] Eigen::Vector2d pixel_of(const CameraModel& camera, const Eigen::Vector2d& n);

}  // namespace dive::estimation::testing
