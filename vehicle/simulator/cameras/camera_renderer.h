#pragma once
// One camera: one ray through the centre of each pixel, and four through each pixel that an edge
// crosses.

#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "vehicle/simulator/cameras/visible_scene.h"
#include "vehicle/simulator/water/water_light.h"

namespace dive::vehicle {

class CameraRenderer {
 public:
  CameraRenderer(const CameraModel& camera, const std::vector<Lamp>& lamps,
                 const WaterOptics& water, const Bands& spectrum);

  /// Renders the view from X_WB; all black if the lens is inside a solid.
  void render(const VisibleScene& scene, WaterLight& light, const Pose& X_WB, double t_s,
              const std::optional<Pose>& X_DW);

  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  /// Radiance of the last rendering, by pixel, row by row.
  [[nodiscard]] const std::vector<float>& radiance() const { return radiance_; }
  [[nodiscard]] std::vector<float>& radiance() { return radiance_; }
  /// Distance to the surface along the pixel's ray, m; kFar if there is none.
  [[nodiscard]] const std::vector<float>& distance() const { return distance_; }

 private:
  struct View {
    const VisibleScene& scene;
    const WaterLight& light;
    Eigen::Vector3d lens_W;
    Eigen::Matrix3f R_WC;
    std::optional<Pose> X_DW;
  };

  void aim_row(const View& view, int row, int first, int count);
  void shade_rays(const View& view);
  void render_row(const View& view, int row);
  void find_edges(const View& view);
  [[nodiscard]] bool is_edge(const View& view, std::size_t a, std::size_t b) const;
  void smooth_edges(const View& view);

  CameraModel camera_;
  LampVeil lamp_veil_;
  std::vector<float> x_C_, y_C_, z_C_;  // unit rays in C, by pixel
  RayBatch rays_;
  VisibleScene::Ids ids_{};
  std::vector<std::uint32_t> met_;  // by pixel
  std::vector<float> distance_;
  std::vector<float> radiance_;
  std::vector<std::uint8_t> differs_;  // difference from the pixel to the right or below
  std::vector<std::uint8_t> is_edge_;
  std::vector<std::size_t> edges_;
};

}  // namespace dive::vehicle
