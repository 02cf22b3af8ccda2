#pragma once
// The front stereo pair, by tracing a ray per pixel (Embree) through the world and the water.
//
// Mounted where vehicle/aqua2.urdf has camera_front_left and camera_front_right, both tilted down.
// Camera frame C as in common/camera_model.h. What the water does: water_optics.h; what surfaces
// look like: solid_texture.h; what the sensor makes of it: image_sensor.h. Both are exposed alike,
// at the same moment and in no time: moving blurs nothing.

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
#include "vehicle/simulator/image_sensor.h"
#include "vehicle/simulator/water_optics.h"

namespace dive::vehicle {

struct StereoCameraOptions {
  int width = 752;
  int height = 480;
  double fx = 240.0;  ///< Pixels, under water: 115 degrees across, 90 from top to bottom.
  double fy = 240.0;
  double cx = 375.5;
  double cy = 239.5;
  std::array<double, 4> radtan{};  ///< As CameraModel has them.
  double tilt_deg = 40.0;          ///< Of the optical axes below x of B.
  Eigen::Vector3d left_B = {0.31, 0.07, 0.0};
  Eigen::Vector3d right_B = {0.31, -0.07, 0.0};
  double rate_hz = 20.0;
  Bands spectrum = {0.30, 0.45, 0.25};  ///< What the grey sensor makes of red, green and blue.
  WaterOptics water;
  std::vector<Lamp> lamps;  ///< None: see bow_lamps().
  ImageSensorOptions sensor;
  std::vector<Tag> tags;  ///< That are to be seen there.

  /// The same view with so many times the pixels along each side: coarser cameras cost less.
  [[nodiscard]] StereoCameraOptions scaled(double factor) const;
  /// Of camera 0 (left) or 1 (right).
  [[nodiscard]] CameraModel camera(int index) const;
  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
};

enum class CameraFault {
  kNone,
  kBlackout,  ///< Black pictures, as with a cap on the lens.
  kFrozen,    ///< The last picture again, with new stamps.
  kMissing,   ///< No pictures.
  kBlur,      ///< Out of focus, by 4 pixels (standard deviation).
};

/// What one moment gives: left and right; nothing where a camera gives none.
using StereoFrames = std::array<std::optional<ImageFrame>, 2>;

/// Same world, options and seed, same calls: the same pictures, bit for bit.
class StereoCamera {
 public:
  /// Demands options that validate. The world as TracedWorld has it.
  StereoCamera(const planning::World& world, StereoCameraOptions options, std::uint64_t seed);
  StereoCamera(StereoCamera&&) noexcept;
  StereoCamera& operator=(StereoCamera&&) noexcept;
  ~StereoCamera();

  /// Whether a pair falls due, rate_hz times a second from 0 on.
  [[nodiscard]] bool due(Utime now) const;
  /// One pair at a finite pose; X_WD: that of a Diver who is in the water. Above the water it looks
  /// as if the water reached up to the lens.
  [[nodiscard]] StereoFrames take(Utime now, const Pose& X_WB,
                                  const std::optional<Pose>& X_WD = std::nullopt);

  /// Of camera 0 or 1, from now on.
  void set_fault(int index, CameraFault fault);
  /// The water moves over ground, m/s, and the marine snow with it, from now on.
  void set_current(const Eigen::Vector3d& current_W);
  /// The daylight is so many times what it was made with: clouds, dusk. Not negative.
  void set_daylight(double factor);

  [[nodiscard]] const StereoCameraOptions& options() const;
  /// Of the pair that was taken last.
  [[nodiscard]] Exposure exposure() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::vehicle
