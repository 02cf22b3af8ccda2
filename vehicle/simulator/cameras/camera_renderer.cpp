#include "vehicle/simulator/cameras/camera_renderer.h"

#include <cmath>

#include <Eigen/LU>

namespace dive::vehicle {
namespace {

// Four samples of a pixel, no two of them in one row or column.
constexpr std::array<std::array<float, 2>, 4> kSamples{
    {{-0.125F, -0.375F}, {0.375F, -0.125F}, {0.125F, 0.375F}, {-0.375F, 0.125F}}};
constexpr double kFlat = 0.02;  // of the distance: a smaller step is not an edge

DIVE_VECTOR_LOOP void turn(const Eigen::Matrix3f& R, const float* x, const float* y, const float* z,
                           int count, RayBatch& rays) {
  const float xx = R(0, 0), xy = R(0, 1), xz = R(0, 2);
  const float yx = R(1, 0), yy = R(1, 1), yz = R(1, 2);
  const float zx = R(2, 0), zy = R(2, 1), zz = R(2, 2);
  for (int k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    rays.dx[i] = xx * x[i] + xy * y[i] + xz * z[i];
    rays.dy[i] = yx * x[i] + yy * y[i] + yz * z[i];
    rays.dz[i] = zx * x[i] + zy * y[i] + zz * z[i];
  }
}

DIVE_VECTOR_LOOP void compare(const std::uint32_t* a, const std::uint32_t* b, std::size_t count,
                              std::uint8_t* differs) {
  for (std::size_t i = 0; i < count; ++i) differs[i] = a[i] != b[i] ? 1 : 0;
}

DIVE_VECTOR_LOOP void or_compare(const std::uint32_t* a, const std::uint32_t* b, std::size_t count,
                                 std::uint8_t* differs) {
  for (std::size_t i = 0; i < count; ++i) differs[i] |= a[i] != b[i] ? 1 : 0;
}

}  // namespace

CameraRenderer::CameraRenderer(const CameraModel& camera, const std::vector<Lamp>& lamps,
                               const WaterOptics& water, const Bands& spectrum)
    : camera_(camera), lamp_veil_(camera, lamps, water, spectrum) {
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector2d n =
          camera.undistort({1.0 * u, 1.0 * v}).value_or(Eigen::Vector2d::Zero());
      const Eigen::Vector3f d = Eigen::Vector3d(n.x(), n.y(), 1.0).normalized().cast<float>();
      x_C_.push_back(d.x());
      y_C_.push_back(d.y());
      z_C_.push_back(d.z());
    }
  }
  met_.resize(x_C_.size());
  distance_.resize(x_C_.size());
  radiance_.resize(x_C_.size());
  differs_.resize(x_C_.size());
  is_edge_.resize(x_C_.size());
}

void CameraRenderer::render(const VisibleScene& scene, WaterLight& light, const Pose& X_WB,
                            double t_s, const std::optional<Pose>& X_DW) {
  const Pose X_WC = X_WB * camera_.X_BC;
  if (scene.covers(X_WC.p, X_DW)) {
    std::fill(radiance_.begin(), radiance_.end(), 0.0F);
    std::fill(distance_.begin(), distance_.end(), 0.0F);
    return;
  }
  light.begin(X_WB, X_WC.p, scene.sky().at(X_WC.p), t_s);
  const View view{scene, light, X_WC.p, X_WC.q.toRotationMatrix().cast<float>(), X_DW};
  for (int row = 0; row < camera_.height; ++row) render_row(view, row);
  find_edges(view);
  smooth_edges(view);
}

void CameraRenderer::shade_rays(const View& view) {
  view.scene.meet(view.lens_W, 1.0 / camera_.focal(), view.X_DW, rays_, ids_);
  lamp_veil_.fill(rays_);
  paint(rays_);
  view.light.shade(rays_);
}

void CameraRenderer::render_row(const View& view, int row) {
  for (int first = 0; first < camera_.width; first += RayBatch::kSize) {
    const int count = std::min(RayBatch::kSize, camera_.width - first);
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(row) * camera_.width + first;
    turn(view.R_WC, x_C_.data() + at, y_C_.data() + at, z_C_.data() + at, count, rays_);
    for (int k = 0; k < count; ++k) {
      rays_.u[static_cast<std::size_t>(k)] = static_cast<float>(first + k);
      rays_.v[static_cast<std::size_t>(k)] = static_cast<float>(row);
    }
    rays_.count = count;
    shade_rays(view);
    std::copy_n(rays_.radiance.begin(), count, radiance_.begin() + at);
    std::copy_n(rays_.distance.begin(), count, distance_.begin() + at);
    std::copy_n(ids_.begin(), count, met_.begin() + at);
  }
}

bool CameraRenderer::is_edge(const View& view, std::size_t a, std::size_t b) const {
  if (met_[a] == met_[b]) return false;
  const auto continues = [&](std::size_t from, std::size_t to) {
    const Eigen::Vector3f d_W = view.R_WC * Eigen::Vector3f(x_C_[to], y_C_[to], z_C_[to]);
    const auto t = static_cast<double>(distance_[to]);
    return view.scene.continues(met_[from], view.lens_W + t * d_W.cast<double>(), kFlat * t);
  };
  return !continues(a, b) || !continues(b, a);
}

void CameraRenderer::find_edges(const View& view) {
  const auto width = static_cast<std::size_t>(camera_.width);
  const std::size_t last_row = met_.size() - width;
  compare(met_.data(), met_.data() + 1, met_.size() - 1, differs_.data());
  or_compare(met_.data(), met_.data() + width, last_row, differs_.data());
  std::fill(is_edge_.begin(), is_edge_.end(), std::uint8_t{0});
  for (std::size_t i = 0; i < met_.size(); ++i) {
    if (differs_[i] == 0) continue;
    if ((i + 1) % width != 0 && is_edge(view, i, i + 1)) is_edge_[i] = is_edge_[i + 1] = 1;
    if (i < last_row && is_edge(view, i, i + width)) is_edge_[i] = is_edge_[i + width] = 1;
  }
  edges_.clear();
  for (std::size_t i = 0; i < is_edge_.size(); ++i) {
    if (is_edge_[i] != 0) edges_.push_back(i);
  }
}

void CameraRenderer::smooth_edges(const View& view) {
  constexpr std::size_t kPixels = RayBatch::kSize / kSamples.size();
  const auto width = static_cast<std::size_t>(camera_.width);
  for (std::size_t first = 0; first < edges_.size(); first += kPixels) {
    const std::size_t pixels = std::min(kPixels, edges_.size() - first);
    std::size_t k = 0;
    for (std::size_t j = 0; j < pixels; ++j) {
      const std::size_t i = edges_[first + j];
      const Eigen::Vector2d n(x_C_[i] / z_C_[i], y_C_[i] / z_C_[i]);
      const Eigen::Matrix2f per_pixel = camera_.jacobian(n).inverse().cast<float>();
      for (const auto& [du, dv] : kSamples) {
        const Eigen::Vector2f step = z_C_[i] * (per_pixel * Eigen::Vector2f(du, dv));
        const Eigen::Vector3f d_C(x_C_[i] + step.x(), y_C_[i] + step.y(), z_C_[i]);
        const Eigen::Vector3f d_W = view.R_WC * d_C.normalized();
        rays_.dx[k] = d_W.x();
        rays_.dy[k] = d_W.y();
        rays_.dz[k] = d_W.z();
        rays_.u[k] = static_cast<float>(i % width) + du;
        rays_.v[k] = static_cast<float>(i / width) + dv;
        ++k;
      }
    }
    rays_.count = static_cast<int>(k);
    shade_rays(view);
    for (std::size_t j = 0; j < pixels; ++j) {
      float sum = 0.0F;
      for (std::size_t s = 0; s < kSamples.size(); ++s) {
        sum += rays_.radiance[j * kSamples.size() + s];
      }
      radiance_[edges_[first + j]] = sum / static_cast<float>(kSamples.size());
    }
  }
}

}  // namespace dive::vehicle
