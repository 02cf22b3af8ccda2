#pragma once
// The front stereo pair, by tracing a ray per pixel (Embree) through the world and the water.
//
// Mounted at camera_front_left and camera_front_right of vehicle/aqua2.urdf, both tilted down.
// Camera frame C as in common/camera_model.h. Water: water_optics.h; surfaces: solid_texture.h;
// sensor: image_sensor.h. Both cameras have the same exposure at the same instant, without motion
// blur.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/clock.h"
#include "common/measurements.h"
#include "common/se3.h"
#include "common/tag.h"
#include "planning/world/world.h"
#include "vehicle/simulator/cameras/image_sensor.h"
#include "vehicle/simulator/water/water_optics.h"

namespace dive::vehicle {

struct StereoCameraOptions {
  int width = 752;
  int height = 480;
  double fx = 240.0;  ///< Pixels, under water: 115 degrees across, 90 from top to bottom.
  double fy = 240.0;
  double cx = 375.5;
  double cy = 239.5;
  LensModel lens = LensModel::kPinhole;     ///< Lens as in CameraModel.
  std::array<double, 4> lens_parameters{};  ///< Parameters of the lens as in CameraModel.
  std::array<double, 8> radtan{};           ///< Distortion as in CameraModel.
  double tilt_deg = 40.0;                   ///< Tilt of the optical axes below x of B.
  Eigen::Vector3d left_B = {0.31, 0.07, 0.0};
  Eigen::Vector3d right_B = {0.31, -0.07, 0.0};
  double rate_hz = 20.0;
  Bands spectrum = {0.30, 0.45, 0.25};  ///< Response of the grey sensor to red, green and blue.
  WaterOptics water;
  std::vector<Lamp> lamps;  ///< Lamps, default none; see bow_lamps().
  ImageSensorOptions sensor;
  std::vector<Tag> tags;  ///< AprilTags in the world.

  /// The same view with `factor` times the pixels along each side: coarser cameras cost less.
  [[nodiscard]] StereoCameraOptions scaled(double factor) const;
  /// The model of camera 0 (left) or 1 (right).
  [[nodiscard]] CameraModel camera(int index) const;
  /// A description of the first error; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
};

enum class CameraFault {
  kNone,
  kBlackout,  ///< Black images, as with a cap on the lens.
  kFrozen,    ///< The last image repeated with new stamps.
  kMissing,   ///< No images.
  kBlur,      ///< Defocus of 4 pixels (standard deviation).
};

/// Images of one instant, left and right; empty for a camera that gives none.
using StereoFrames = std::array<std::optional<ImageFrame>, 2>;

/// Equal world, options, seed and calls give bit-identical images.
class StereoCamera {
 public:
  /// Demands options that validate. The world is traced as in TracedWorld.
  StereoCamera(const planning::World& world, StereoCameraOptions options, std::uint64_t seed);
  StereoCamera(StereoCamera&&) noexcept;
  StereoCamera& operator=(StereoCamera&&) noexcept;
  ~StereoCamera();

  /// True if a pair is due: rate_hz times a second from 0 on.
  [[nodiscard]] bool due(Utime now) const;
  /// Takes one pair at a finite pose; X_WD: pose of a Diver in the water. A lens above the water
  /// renders as if the water reached up to it.
  [[nodiscard]] StereoFrames take(Utime now, const Pose& X_WB,
                                  const std::optional<Pose>& X_WD = std::nullopt);

  /// Sets the fault of camera 0 or 1 from now on.
  void set_fault(int index, CameraFault fault);
  /// Sets the velocity of the water and its marine snow over ground from now on, m/s.
  void set_current(const Eigen::Vector3d& current_W);

  [[nodiscard]] const StereoCameraOptions& options() const;
  /// Exposure of the last pair.
  [[nodiscard]] Exposure exposure() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::vehicle
