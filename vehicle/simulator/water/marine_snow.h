#pragma once
// Marine snow: particles that drift with the water and slightly on their own, rendered as bright
// discs.
//
// A particle of radius r at depth z on the axis has an image of radius f r / z, widened to a disc
// by a lens focused at 2 m (aperture A: circle of confusion f A |1/z - 1/2 m|), over which its
// light is spread.

#include <cstdint>
#include <vector>

#include "common/camera_model.h"
#include "common/clock.h"
#include "vehicle/simulator/water/drifter.h"
#include "vehicle/simulator/water/water_light.h"

namespace dive::vehicle {

class MarineSnow {
 public:
  MarineSnow(const WaterOptics& water, std::uint64_t seed);

  /// Sets the water's velocity over ground from now on, m/s.
  void set_current(const Eigen::Vector3d& current_W) { current_W_ = current_W; }
  /// Drifts until `now`; an earlier time changes nothing.
  void advance(Utime now);
  /// Adds the particles to radiances, in front of surfaces farther away; `distance` by pixel.
  void draw(const CameraModel& camera, const Pose& X_WC, const WaterLight& light, float sky,
            const std::vector<float>& distance, std::vector<float>& radiance) const;

 private:
  struct Particle {
    Drifter place;
    double radius;  // m
  };
  void draw_disc(const CameraModel& camera, const Eigen::Vector2d& centre, double radius_px,
                 float light, float far, const std::vector<float>& distance,
                 std::vector<float>& radiance) const;

  std::vector<Particle> particles_;
  Eigen::Vector3d current_W_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d drift_W_ = Eigen::Vector3d::Zero();
  Utime utime_ = 0;
};

}  // namespace dive::vehicle
