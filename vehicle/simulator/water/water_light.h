#pragma once
// The equation of water_optics.h for many rays at once, weighted with the sensor's response to each
// band.

#include <vector>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "common/se3.h"
#include "vehicle/simulator/ray_tracing/ray_batch.h"
#include "vehicle/simulator/water/water_optics.h"

namespace dive::vehicle {

/// Backscatter of the vehicle's own lamps into one of its cameras. It is fixed in the camera's
/// frame, so that it is summed once, at nodes over the image and along each line of sight.
class LampVeil {
 public:
  /// `spectrum`: weights of the bands.
  LampVeil(const CameraModel& camera, const std::vector<Lamp>& lamps, const WaterOptics& water,
           const Bands& spectrum);
  /// Writes `lamp_veil`.
  void fill(RayBatch& rays) const;

 private:
  static constexpr int kColumns = 25;
  static constexpr int kRows = 17;
  static constexpr int kDepths = 32;

  std::vector<float> sums_;  // by row, column, distance; empty without lamps
  float columns_per_px_;
  float rows_per_px_;
};

class WaterLight {
 public:
  WaterLight(const WaterOptics& water, std::vector<Lamp> lamps, const Bands& spectrum);

  /// Sets the pose of the lens and the phase of the caustics.
  void begin(const Pose& X_WB, const Eigen::Vector3d& lens_W, float sky_at_lens, double t_s);
  /// Writes `radiance`.
  void shade(RayBatch& rays) const;
  /// Radiance of a small white object at p_W at the lens.
  [[nodiscard]] float of_particle(const Eigen::Vector3d& p_W, float sky) const;

 private:
  struct PlacedLamp {
    Eigen::Vector3f p_W;
    Eigen::Vector3f direction_W;
    float power;
    float inner;  // cosines between which the power falls
    float outer;
  };
  using Figures = std::array<float, 3>;

  void daylight(const RayBatch& rays, RayBatch::Floats& sunlit) const;
  void add_caustics(const RayBatch& rays, RayBatch::Floats& sunlit) const;
  [[nodiscard]] float caustics_at(float depth) const;
  void add_veil(RayBatch& rays) const;
  void add_lamp(const PlacedLamp& lamp, RayBatch& rays) const;

  std::vector<Lamp> lamps_;
  Figures beam_, veil_, downwelling_;
  Figures surface_light_;  // E_0 times the sensor's weight
  Figures veil_light_;     // b E_0 times the sensor's weight
  Figures spectrum_;
  float caustics_, caustics_depth_;
  bool has_daylight_;
  // Values of the present image.
  std::vector<PlacedLamp> placed_;
  Eigen::Vector3f lens_W_ = Eigen::Vector3f::Zero();
  float sky_at_lens_ = 1.0F;
  float t_s_ = 0.0F;
};

}  // namespace dive::vehicle
