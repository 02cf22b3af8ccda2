#include "vehicle/simulator/water/water_light.h"

#include <cmath>
#include <utility>

#include "vehicle/simulator/cameras/solid_texture.h"

namespace dive::vehicle {
namespace {

constexpr float kNearLamp = 0.05F;    // m: minimum distance at which the lamp is a point
constexpr float kNodeScale = 0.012F;  // m: node k of a line of sight is at k^2 times this
constexpr float kSide = 0.2F;         // fraction of the daylight that is level; less from below

std::array<float, 3> floats(const Bands& bands) {
  return {static_cast<float>(bands[0]), static_cast<float>(bands[1]), static_cast<float>(bands[2])};
}

// Cosines between which a lamp's power falls from full to zero; half of it at half_angle_deg.
std::array<float, 2> cone(const Lamp& lamp) {
  const double half = deg_to_rad(lamp.half_angle_deg);
  const double soft = 0.35 * half;
  return {static_cast<float>(std::cos(half - soft)), static_cast<float>(std::cos(half + soft))};
}

// P g(theta) exp(-beta r) / r^2 per band, at p.
Bands lit(const Lamp& lamp, const Eigen::Vector3d& p, const Bands& beam) {
  const Eigen::Vector3d from_lamp = p - lamp.p_B;
  const double r = std::max(from_lamp.norm(), static_cast<double>(kNearLamp));
  const auto [inner, outer] = cone(lamp);
  const auto cosine = static_cast<float>(from_lamp.dot(lamp.direction_B.normalized()) / r);
  return lamp.power * static_cast<double>(smooth_step(outer, inner, cosine)) / (r * r) *
         (-beam * r).exp();
}

}  // namespace

LampVeil::LampVeil(const CameraModel& camera, const std::vector<Lamp>& lamps,
                   const WaterOptics& water, const Bands& spectrum)
    : columns_per_px_(static_cast<float>(kColumns - 1) / static_cast<float>(camera.width - 1)),
      rows_per_px_(static_cast<float>(kRows - 1) / static_cast<float>(camera.height - 1)) {
  if (lamps.empty()) return;
  constexpr int kSteps = 8;  // steps of the sum between two nodes
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Eigen::Vector2d pixel(column / static_cast<double>(columns_per_px_),
                                  row / static_cast<double>(rows_per_px_));
      const Eigen::Vector2d n = camera.undistort(pixel).value_or(Eigen::Vector2d::Zero());
      const Eigen::Vector3d d_B = camera.X_BC.q * Eigen::Vector3d(n.x(), n.y(), 1.0).normalized();
      double sum = 0.0;
      for (int k = 0; k < kDepths; ++k) {
        sums_.push_back(static_cast<float>(sum));
        const double from = static_cast<double>(kNodeScale) * k * k;
        const double step = static_cast<double>(kNodeScale) * (2 * k + 1) / kSteps;
        for (int i = 0; i < kSteps; ++i) {
          const double t = from + (i + 0.5) * step;
          Bands light = Bands::Zero();
          for (const Lamp& lamp : lamps) light += lit(lamp, camera.X_BC.p + t * d_B, water.beam);
          sum += step * (spectrum * water.lamp_backscatter * light * (-water.beam * t).exp()).sum();
        }
      }
    }
  }
}

DIVE_VECTOR_LOOP void LampVeil::fill(RayBatch& rays) const {
  if (sums_.empty()) {
    rays.lamp_veil.fill(0.0F);
    return;
  }
  const float* const sums = sums_.data();
  const float columns_per_px = columns_per_px_;
  const float rows_per_px = rows_per_px_;
  alignas(64) RayBatch::Floats veil;  // a local array, which cannot alias anything else
  for (int j = 0; j < RayBatch::kSize; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const float x = std::clamp(rays.u[i] * columns_per_px, 0.0F, kColumns - 1.001F);
    const float y = std::clamp(rays.v[i] * rows_per_px, 0.0F, kRows - 1.001F);
    const float z = std::min(std::sqrt(rays.distance[i] / kNodeScale), kDepths - 1.001F);
    const int ix = static_cast<int>(x);
    const int iy = static_cast<int>(y);
    const int iz = static_cast<int>(z);
    const float fx = x - static_cast<float>(ix);
    const float fy = y - static_cast<float>(iy);
    const float fz = z - static_cast<float>(iz);
    const int at = (iy * kColumns + ix) * kDepths + iz;
    const auto along = [&](int k) { return sums[k] + fz * (sums[k + 1] - sums[k]); };
    const float above = along(at) + fx * (along(at + kDepths) - along(at));
    const int below_at = at + kColumns * kDepths;
    const float below = along(below_at) + fx * (along(below_at + kDepths) - along(below_at));
    veil[i] = above + fy * (below - above);
  }
  rays.lamp_veil = veil;
}

WaterLight::WaterLight(const WaterOptics& water, std::vector<Lamp> lamps, const Bands& spectrum)
    : lamps_(std::move(lamps)),
      beam_(floats(water.beam)),
      veil_(floats(water.veil)),
      downwelling_(floats(water.downwelling)),
      surface_light_(floats(water.daylight * spectrum)),
      veil_light_(floats(water.backscatter * water.daylight * spectrum)),
      spectrum_(floats(spectrum)),
      caustics_(static_cast<float>(water.caustics)),
      caustics_depth_(static_cast<float>(water.caustics_depth_m)),
      has_daylight_((water.daylight > 0.0).any()) {}

void WaterLight::begin(const Pose& X_WB, const Eigen::Vector3d& lens_W, float sky_at_lens,
                       double t_s) {
  lens_W_ = lens_W.cast<float>();
  sky_at_lens_ = sky_at_lens;
  t_s_ = static_cast<float>(t_s);
  placed_.clear();
  for (const Lamp& lamp : lamps_) {
    const auto [inner, outer] = cone(lamp);
    placed_.push_back({(X_WB * lamp.p_B).cast<float>(),
                       (X_WB.q * lamp.direction_B.normalized()).cast<float>(),
                       static_cast<float>(lamp.power), inner, outer});
  }
}

// The caustics that waves project downwards: bright lines at the mid-level crossings of a drifting
// noise, of mean about 1. They vanish with depth, and where a pixel is wider than their pattern.
DIVE_VECTOR_LOOP void WaterLight::add_caustics(const RayBatch& rays,
                                               RayBatch::Floats& sunlit) const {
  constexpr float kMean = 0.5F;
  for (int k = 0; k < RayBatch::kSize; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float d = std::min(rays.distance[i], 1e3F);
    const float x = lens_W_.x() + d * rays.dx[i];
    const float y = lens_W_.y() + d * rays.dy[i];
    const float depth = std::max(0.0F, -(lens_W_.z() + d * rays.dz[i]));
    const float strength =
        caustics_at(depth) * octave_share(0.35F, rays.footprint[i]) * std::max(0.0F, rays.nz[i]);
    const float a = value_noise(x * 2.3F + 0.31F * t_s_, y * 2.3F, 0.9F * t_s_, 11U);
    const float b = value_noise(x * 2.9F, y * 2.9F - 0.37F * t_s_, 1.1F * t_s_ + 7.0F, 12U);
    const float line = std::max(0.0F, 1.0F - 2.2F * std::min(std::abs(a), std::abs(b)));
    sunlit[i] *= 1.0F + strength * (1.6F * line * line * line - kMean);
  }
}

DIVE_INLINE float WaterLight::caustics_at(float depth) const {
  constexpr float kFaint = 0.03F;
  return std::max(0.0F, caustics_ * fast_exp(-depth / caustics_depth_) - kFaint);
}

DIVE_VECTOR_LOOP void WaterLight::daylight(const RayBatch& rays, RayBatch::Floats& sunlit) const {
  for (int k = 0; k < RayBatch::kSize; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float up = std::max(0.0F, rays.nz[i]);
    sunlit[i] = rays.sky[i] * (up * (1.0F - kSide) + kSide * (1.0F - up) +
                               0.7F * kSide * std::min(0.0F, rays.nz[i]));
  }
}

DIVE_VECTOR_LOOP void WaterLight::add_veil(RayBatch& rays) const {
  const float depth = std::max(0.0F, -lens_W_.z());
  Figures at_lens;
  for (std::size_t c = 0; c < 3; ++c)
    at_lens[c] = veil_light_[c] * fast_exp(-downwelling_[c] * depth);
  for (int k = 0; k < RayBatch::kSize; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float open = 0.5F * (sky_at_lens_ + rays.sky[i]);
    float sum = 0.0F;
    for (std::size_t c = 0; c < 3; ++c) {
      const float rate = std::max(0.01F, veil_[c] - downwelling_[c] * rays.dz[i]);
      sum += at_lens[c] * (1.0F - fast_exp(-rate * rays.distance[i])) / rate;
    }
    rays.radiance[i] += open * sum;
  }
}

DIVE_VECTOR_LOOP void WaterLight::add_lamp(const PlacedLamp& lamp, RayBatch& rays) const {
  const float ox = lens_W_.x() - lamp.p_W.x();
  const float oy = lens_W_.y() - lamp.p_W.y();
  const float oz = lens_W_.z() - lamp.p_W.z();
  const float ax = lamp.direction_W.x();
  const float ay = lamp.direction_W.y();
  const float az = lamp.direction_W.z();
  for (int k = 0; k < RayBatch::kSize; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float d = rays.distance[i];
    const float x = ox + d * rays.dx[i];
    const float y = oy + d * rays.dy[i];
    const float z = oz + d * rays.dz[i];
    const float r = std::max(kNearLamp, std::sqrt(x * x + y * y + z * z));
    const float incidence = std::max(0.0F, -(x * rays.nx[i] + y * rays.ny[i] + z * rays.nz[i]) / r);
    const float aim = smooth_step(lamp.outer, lamp.inner, (x * ax + y * ay + z * az) / r);
    const float light = lamp.power * aim * incidence / (r * r);
    const float path = -(r + d);
    rays.radiance[i] += light * (spectrum_[0] * rays.red[i] * fast_exp(beam_[0] * path) +
                                 spectrum_[1] * rays.green[i] * fast_exp(beam_[1] * path) +
                                 spectrum_[2] * rays.blue[i] * fast_exp(beam_[2] * path));
  }
}

DIVE_VECTOR_LOOP static void direct(const std::array<float, 3>& surface_light,
                                    const std::array<float, 3>& beam,
                                    const std::array<float, 3>& downwelling, float lens_z,
                                    const RayBatch::Floats& sunlit, RayBatch& rays) {
  for (int k = 0; k < RayBatch::kSize; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float d = rays.distance[i];
    const float depth = std::max(0.0F, -(lens_z + d * rays.dz[i]));
    const std::array<float, 3> albedo{rays.red[i], rays.green[i], rays.blue[i]};
    float sum = 0.0F;
    for (std::size_t c = 0; c < 3; ++c) {
      sum += surface_light[c] * (albedo[c] * sunlit[i] + rays.glow[i]) *
             fast_exp(-(downwelling[c] * depth + beam[c] * d));
    }
    rays.radiance[i] = rays.lamp_veil[i] + sum;
  }
}

void WaterLight::shade(RayBatch& rays) const {
  if (has_daylight_) {
    RayBatch::Floats sunlit;
    daylight(rays, sunlit);
    float highest = -1e9F;
    for (int k = 0; k < rays.count; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (rays.texture[i] != 0) highest = std::max(highest, rays.tz[i]);
    }
    if (caustics_at(-highest) > 0.0F) add_caustics(rays, sunlit);
    direct(surface_light_, beam_, downwelling_, lens_W_.z(), sunlit, rays);
    add_veil(rays);
  } else {
    rays.radiance = rays.lamp_veil;
  }
  for (const PlacedLamp& lamp : placed_) add_lamp(lamp, rays);
}

float WaterLight::of_particle(const Eigen::Vector3d& p_W, float sky) const {
  const Eigen::Vector3f p = p_W.cast<float>();
  const float d = (p - lens_W_).norm();
  const float depth = std::max(0.0F, -p.z());
  float sum = 0.0F;
  for (std::size_t c = 0; c < 3; ++c) {
    float light = 0.5F * sky * surface_light_[c] * fast_exp(-downwelling_[c] * depth);
    for (const PlacedLamp& lamp : placed_) {
      const Eigen::Vector3f from_lamp = p - lamp.p_W;
      const float r = std::max(kNearLamp, from_lamp.norm());
      light += spectrum_[c] * lamp.power *
               smooth_step(lamp.outer, lamp.inner, from_lamp.dot(lamp.direction_W) / r) / (r * r) *
               fast_exp(-beam_[c] * r);
    }
    sum += light * fast_exp(-beam_[c] * d);
  }
  return sum;
}

}  // namespace dive::vehicle
