#include "vehicle/simulator/water/sky_light.h"

#include <cmath>
#include <numbers>

namespace dive::vehicle {
namespace {

constexpr double kMaxCorners = 150'000.0;
constexpr double kMinCell = 0.4;  // m
constexpr int kRays = 9;
constexpr double kWindow = 0.85;  // rad, half the width of Snell's window

// Directions of equal weight for a uniform sky: the middle, and two rings.
std::array<Eigen::Vector3d, kRays> directions() {
  std::array<Eigen::Vector3d, kRays> result;
  result[0] = Eigen::Vector3d::UnitZ();
  const double rim = std::sin(kWindow);
  for (int i = 1; i < kRays; ++i) {
    const bool is_outer = i > 3;
    const double sine = rim * (is_outer ? 0.82 : 0.47);
    const double angle = 2.0 * std::numbers::pi * (is_outer ? (i - 3.6) / 5.0 : i / 3.0);
    result[static_cast<std::size_t>(i)] = {sine * std::cos(angle), sine * std::sin(angle),
                                           std::sqrt(1.0 - sine * sine)};
  }
  return result;
}

// Extended down to the half-spaces below everything bounded, and to the sides as far as shadows
// reach there.
Eigen::AlignedBox3d with_ground(Eigen::AlignedBox3d box, const std::vector<TracedPlane>& planes) {
  constexpr double kMaxHeight = 6.0;  // m: the shadow of a higher object is faint
  const Eigen::Vector3d middle = box.center();
  double ground = box.min().z();
  for (const auto& [normal, offset] : planes) {
    if (normal.z() < 0.7) continue;
    ground = std::min(ground, (offset - normal.head<2>().dot(middle.head<2>())) / normal.z());
  }
  if (ground >= box.min().z()) return box;
  const double aside = std::min(kMaxHeight, std::tan(kWindow) * (box.max().z() - ground));
  box.min() -= Eigen::Vector3d(aside, aside, 0.0);
  box.max() += Eigen::Vector3d(aside, aside, 0.0);
  box.min().z() = ground;
  return box;
}

}  // namespace

SkyLight::SkyLight(const TracedWorld& traced, const Eigen::AlignedBox3d& bounds) {
  if (bounds.isEmpty() || traced.triangles().size() == 0) return;
  const Eigen::AlignedBox3d shaded = with_ground(bounds, traced.planes());
  Eigen::Vector3d high = shaded.max();
  high.z() = std::min(high.z(), 0.0);
  low_ = shaded.min();
  const Eigen::Vector3d size = (high - low_).cwiseMax(kMinCell);
  cell_ = std::max(kMinCell, std::cbrt(size.prod() / kMaxCorners));
  for (int k = 0; k < 3; ++k) {
    corners_[static_cast<std::size_t>(k)] = static_cast<int>(std::ceil(size[k] / cell_)) + 1;
  }
  measure(traced);
}

void SkyLight::measure(const TracedWorld& traced) {
  const std::array<Eigen::Vector3d, kRays> rays = directions();
  bool is_all_open = true;
  for (int z = 0; z < corners_[2]; ++z) {
    for (int y = 0; y < corners_[1]; ++y) {
      for (int x = 0; x < corners_[0]; ++x) {
        const Eigen::Vector3d p = low_ + cell_ * Eigen::Vector3d(x, y, z);
        int open = 0;
        for (const Eigen::Vector3d& d : rays) {
          open += std::isinf(traced.range(p, d, 1e-3, std::max(0.01, -p.z() / d.z()))) ? 1 : 0;
        }
        is_all_open = is_all_open && open == kRays;
        open_.push_back(static_cast<float>(open) / kRays);
      }
    }
  }
  if (is_all_open) open_.clear();
}

struct SkyLight::Grid {
  explicit Grid(const SkyLight& sky)
      : inverse(static_cast<float>(1.0 / sky.cell_)),
        x0(static_cast<float>(sky.low_.x())),
        y0(static_cast<float>(sky.low_.y())),
        z0(static_cast<float>(sky.low_.z())),
        last_x(static_cast<float>(sky.corners_[0] - 1)),
        last_y(static_cast<float>(sky.corners_[1] - 1)),
        last_z(static_cast<float>(sky.corners_[2] - 1)),
        row(sky.corners_[0]),
        layer(sky.corners_[0] * sky.corners_[1]),
        open(sky.open_.data()) {}

  DIVE_INLINE float at(float x, float y, float z) const {
    const float ax = (x - x0) * inverse;
    const float ay = (y - y0) * inverse;
    const float az = (z - z0) * inverse;
    const float cx = std::clamp(ax, 0.0F, last_x - 0.001F);
    const float cy = std::clamp(ay, 0.0F, last_y - 0.001F);
    const float cz = std::clamp(az, 0.0F, last_z - 0.001F);
    const int ix = static_cast<int>(cx);
    const int iy = static_cast<int>(cy);
    const int iz = static_cast<int>(cz);
    const float fx = cx - static_cast<float>(ix);
    const float fy = cy - static_cast<float>(iy);
    const float fz = cz - static_cast<float>(iz);
    const auto along_x = [&](int i) { return open[i] + fx * (open[i + 1] - open[i]); };
    const int front_at = iz * layer + iy * row + ix;
    const int back_at = front_at + layer;
    const float front = along_x(front_at) + fy * (along_x(front_at + row) - along_x(front_at));
    const float back = along_x(back_at) + fy * (along_x(back_at + row) - along_x(back_at));
    const float inside = front + fz * (back - front);
    const float outside =  // distance outside, in cells
        std::abs(ax - cx) + std::abs(ay - cy) + std::abs(az - cz);
    const float counts = outside > 0.01F ? 0.0F : 1.0F;
    return 1.0F + counts * (inside - 1.0F);
  }

  float inverse;
  float x0, y0, z0;
  float last_x, last_y, last_z;
  int row, layer;
  const float* open;
};

float SkyLight::at(const Eigen::Vector3d& p_W) const {
  if (open_.empty()) return 1.0F;
  const Eigen::Vector3f p = p_W.cast<float>();
  return Grid(*this).at(p.x(), p.y(), p.z());
}

DIVE_VECTOR_LOOP void SkyLight::fill(const Eigen::Vector3d& o, RayBatch& rays) const {
  if (open_.empty()) {
    rays.sky.fill(1.0F);
    return;
  }
  const Grid grid(*this);
  const auto ox = static_cast<float>(o.x());
  const auto oy = static_cast<float>(o.y());
  const auto oz = static_cast<float>(o.z());
  const auto before = static_cast<float>(0.5 * cell_);
  alignas(64) RayBatch::Floats sky;  // a local array, which cannot alias anything else
  for (int k = 0; k < RayBatch::kSize; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float d = rays.distance[i];
    sky[i] = grid.at(ox + d * rays.dx[i] + before * rays.nx[i],
                     oy + d * rays.dy[i] + before * rays.ny[i],
                     oz + d * rays.dz[i] + before * rays.nz[i]);
  }
  rays.sky = sky;
}

}  // namespace dive::vehicle
