#pragma once
// Marine snow: specks that drift with the water and a little on their own, seen as bright discs.
//
// A speck of radius r at depth z
// on the axis has an image of radius f r / z, widened to a disc by a lens focused at 2 m (aperture
// A: circle of confusion f A |1/z - 1/2 m|), over which its light is spread.

#include <cstdint>
#include <vector>

#include "common/camera_model.h"
#include "common/clock.h"
#include "vehicle/simulator/drifter.h"
#include "vehicle/simulator/water_light.h"

namespace dive::vehicle {

class MarineSnow {
 public:
  MarineSnow(const WaterOptics& water, std::uint64_t seed);

  /// The water moves at this velocity over ground from now on, m/s.
  void set_current(const Eigen::Vector3d& current_W) { current_W_ = current_W; }
  /// Drifts until `now`; earlier than before changes nothing.
  void advance(Utime now);
  /// Adds the specks to radiances, before surfaces farther than they, `distance` by pixel.
  void draw(const CameraModel& camera, const Pose& X_WC, const WaterLight& light, float sky,
            const std::vector<float>& distance, std::vector<float>& radiance) const;

 private:
  struct Speck {
    Drifter place;
    double radius;  // m
  };
  void draw_disc(const CameraModel& camera, const Eigen::Vector2d& centre, double radius_px,
                 float light, float far, const std::vector<float>& distance,
                 std::vector<float>& radiance) const;

  std::vector<Speck> specks_;
  Eigen::Vector3d current_W_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d drift_W_ = Eigen::Vector3d::Zero();
  Utime utime_ = 0;
};

}  // namespace dive::vehicle
