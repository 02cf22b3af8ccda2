#include "test/estimation/visual_inertial/painted_room.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace dive::estimation::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kTable = 256;

// Radial-tangential distortion by the formulas of the ASL format.
Vector2d distorted(const CameraModel& camera, const Vector2d& m) {
  const double x = m.x();
  const double y = m.y();
  const double r2 = x * x + y * y;
  const double k1 = camera.radtan[0];
  const double k2 = camera.radtan[1];
  const double p1 = camera.radtan[2];
  const double p2 = camera.radtan[3];
  const double radial = 1 + k1 * r2 + k2 * r2 * r2;
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
          y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

// The rays of all pixels, by fixed-point iteration on the distortion; an equidistant lens is ideal.
std::vector<Vector2d> rays_of(const CameraModel& camera) {
  std::vector<Vector2d> rays;
  rays.reserve(static_cast<std::size_t>(camera.width * camera.height));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Vector2d d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
      Vector2d n = d;
      for (int k = 0; k < 12; ++k) n += d - distorted(camera, n);
      if (camera.lens == LensModel::kEquidistant && n.norm() > 0.0) {
        n *= std::tan(n.norm()) / n.norm();
      }
      rays.push_back(n);
    }
  }
  return rays;
}

const std::vector<Vector2d>& cached_rays(const CameraModel& camera) {
  static CameraModel last;
  static std::vector<Vector2d> rays;
  if (last.width != camera.width || last.fx != camera.fx || last.radtan != camera.radtan ||
      last.lens != camera.lens) {
    rays = rays_of(camera);
    last = camera;
  }
  return rays;
}

}  // namespace

PaintedRoom::PaintedRoom(const Vector3d& half, std::uint64_t seed) : half_(half), random_(seed) {
  for (int i = 0; i < kTable * kTable; ++i) table_.push_back(static_cast<float>(random_.uniform()));
}

void PaintedRoom::snow(int count, const Vector3d& p_W, double reach, double speed) {
  for (int i = 0; i < count; ++i) {
    const Vector3d p(random_.uniform(-1, 1), random_.uniform(-1, 1), random_.uniform(-1, 1));
    const Vector3d v(random_.normal(), random_.normal(), random_.normal());
    flakes_.push_back({p_W + reach * p, speed * v.normalized()});
  }
}

double PaintedRoom::paint(const Vector3d& p) const {
  // Two coordinates of the wall and a third number that distinguishes the walls.
  const Vector3d share = p.cwiseAbs().cwiseQuotient(half_);
  Eigen::Index axis = 0;
  share.maxCoeff(&axis);
  const double u = p[(axis + 1) % 3] + 31.7 * static_cast<double>(axis);
  const double v = p[(axis + 2) % 3] + (p[axis] > 0 ? 17.3 : 0.0);
  const auto noise = [&](double scale) {
    const double x = u / scale + 1000.0;
    const double y = v / scale + 1000.0;
    const int xi = static_cast<int>(x);
    const int yi = static_cast<int>(y);
    const double fx = x - xi;
    const double fy = y - yi;
    const double sx = fx * fx * (3 - 2 * fx);
    const double sy = fy * fy * (3 - 2 * fy);
    const auto at = [&](int i, int j) -> double {
      return table_[static_cast<std::size_t>((j & (kTable - 1)) * kTable + (i & (kTable - 1)))];
    };
    return (1 - sy) * ((1 - sx) * at(xi, yi) + sx * at(xi + 1, yi)) +
           sy * ((1 - sx) * at(xi, yi + 1) + sx * at(xi + 1, yi + 1));
  };
  return 40.0 + 80.0 * noise(0.31) + 80.0 * noise(0.07);
}

Vector3d PaintedRoom::wall_at(const Pose& X_WC, const Vector2d& n) const {
  const Vector3d d = X_WC.q * n.homogeneous();
  double t = 1e9;
  for (int i = 0; i < 3; ++i) {
    if (d[i] > 1e-12) t = std::min(t, (half_[i] - X_WC.p[i]) / d[i]);
    if (d[i] < -1e-12) t = std::min(t, (-half_[i] - X_WC.p[i]) / d[i]);
  }
  return X_WC.p + t * d;
}

bool PaintedRoom::has_flake(const CameraModel& camera, const Pose& X_WC, Utime utime,
                            const Vector2d& n) const {
  return std::any_of(flakes_.begin(), flakes_.end(), [&](const Flake& flake) {
    const auto at = seen_at(X_WC, flake.p_W + to_seconds(utime) * flake.v_W);
    return at && (pixel_of(camera, *at) - pixel_of(camera, n)).norm() < 3.0;
  });
}

ImageFrame PaintedRoom::image(const CameraModel& camera, const Pose& X_WC, Utime utime,
                              double noise, double light) {
  const std::vector<Vector2d>& rays = cached_rays(camera);
  std::vector<double> values;
  values.reserve(rays.size());
  for (const Vector2d& n : rays) values.push_back(paint(wall_at(X_WC, n)));
  for (const Flake& flake : flakes_) {
    const auto n = seen_at(X_WC, flake.p_W + to_seconds(utime) * flake.v_W);
    if (!n || n->norm() > 1.2) continue;
    const Vector2d at = pixel_of(camera, *n);
    constexpr double kSigma = 2.0;  // px
    for (int v = std::max(0, static_cast<int>(at.y()) - 7);
         v < std::min(camera.height, static_cast<int>(at.y()) + 8); ++v) {
      for (int u = std::max(0, static_cast<int>(at.x()) - 7);
           u < std::min(camera.width, static_cast<int>(at.x()) + 8); ++u) {
        const double r2 = (Vector2d(u, v) - at).squaredNorm();
        values[static_cast<std::size_t>(v * camera.width + u)] +=
            140.0 * std::exp(-0.5 * r2 / (kSigma * kSigma));
      }
    }
  }
  ImageFrame frame;
  frame.utime = utime;
  frame.width = camera.width;
  frame.height = camera.height;
  frame.pixels.reserve(values.size());
  for (const double value : values) {
    // Noise from few bits: a normal number for each pixel would take longer than the image.
    const auto bits = random_.bits();
    const double unit = static_cast<double>(bits & 0xffff) / 65536.0 +
                        static_cast<double>((bits >> 16) & 0xffff) / 65536.0 +
                        static_cast<double>((bits >> 32) & 0xffff) / 65536.0 - 1.5;
    const double seen = light * value + 2.0 * noise * unit;
    frame.pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(seen), 0L, 255L)));
  }
  return frame;
}

CameraModel test_camera(double y) {
  CameraModel camera;
  camera.width = 752;
  camera.height = 480;
  camera.fx = 458.654;
  camera.fy = 457.296;
  camera.cx = 367.215;
  camera.cy = 248.375;
  camera.radtan = {-0.28, 0.074, 0.0002, 2e-05};
  camera.X_BC = {{0.0, y, 0.0}, looking_ahead()};
  return camera;
}

CameraModel pinhole_camera(double y, int width, int height, double f) {
  CameraModel camera = test_camera(y);
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = f;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  camera.radtan = {};
  return camera;
}

CameraModel wide_camera(double y, int width, int height) {
  const double f = 0.5 * width / deg_to_rad(60.0);
  CameraModel camera = pinhole_camera(y, width, height, f);
  camera.lens = LensModel::kEquidistant;
  return camera;
}

Eigen::Quaterniond looking_ahead() {
  Eigen::Matrix3d R_BC;  // columns: x of C to the right (-y), y down (-z), z ahead (x)
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Eigen::Quaterniond(R_BC);
}

std::optional<Vector2d> seen_at(const Pose& X_WC, const Vector3d& p_W) {
  const Vector3d p_C = X_WC.q.conjugate() * (p_W - X_WC.p);
  if (p_C.z() < 0.01) return std::nullopt;
  return Vector2d(p_C.x() / p_C.z(), p_C.y() / p_C.z());
}

Vector2d pixel_of(const CameraModel& camera, const Vector2d& n) {
  Vector2d m = n;
  if (camera.lens == LensModel::kEquidistant && n.norm() > 0.0) {
    m *= std::atan(n.norm()) / n.norm();
  }
  const Vector2d d = distorted(camera, m);
  return {camera.fx * d.x() + camera.cx, camera.fy * d.y() + camera.cy};
}

}  // namespace dive::estimation::testing
