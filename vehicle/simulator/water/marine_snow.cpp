#include "vehicle/simulator/water/marine_snow.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "common/random.h"

namespace dive::vehicle {
namespace {

constexpr std::uint64_t kStream = 23;
constexpr double kSide = 3.0;        // m, side of the box of particles around the lens
constexpr double kAperture = 0.002;  // m
constexpr double kFocus = 2.0;       // m
constexpr double kMinDepth = 0.04;   // m in front of the lens
constexpr double kSpread = 0.47;     // sigma of the logarithm of the radius: a factor of 1.6
constexpr float kAlbedo = 0.7F;

}  // namespace

MarineSnow::MarineSnow(const WaterOptics& water, std::uint64_t seed) {
  Random random(seed, kStream);
  particles_.resize(static_cast<std::size_t>(std::round(water.snow_per_m3 * std::pow(kSide, 3))));
  for (Particle& particle : particles_) {
    particle.place = Drifter::draw(random, kSide, water.snow_speed);
    particle.radius = water.snow_radius_m * std::exp(kSpread * random.normal());
  }
}

void MarineSnow::advance(Utime now) {
  if (now <= utime_) return;
  drift_W_ += to_seconds(now - utime_) * current_W_;
  utime_ = now;
}

void MarineSnow::draw(const CameraModel& camera, const Pose& X_WC, const WaterLight& light,
                      float sky, const std::vector<float>& distance,
                      std::vector<float>& radiance) const {
  const Pose X_CW = X_WC.inverse();
  const double t = to_seconds(utime_);
  for (const Particle& particle : particles_) {
    const Eigen::Vector3d from_lens_W = particle.place.from_lens(X_WC.p - drift_W_, t, kSide);
    const Eigen::Vector3d p_C = X_CW.q * from_lens_W;
    if (p_C.z() < kMinDepth || X_WC.p.z() + from_lens_W.z() > 0.0) continue;
    const std::optional<Eigen::Vector2d> centre = camera.project(p_C);
    if (!centre) continue;
    const double scale = std::sqrt(camera.jacobian(p_C.hnormalized()).determinant());
    const double sharp = scale * particle.radius / p_C.z();
    const double blurred = 0.5 * scale * kAperture * std::abs(1.0 / p_C.z() - 1.0 / kFocus);
    const double radius = std::max(0.6, std::hypot(sharp, blurred));
    if (!camera.in_image(*centre, -radius)) continue;
    const float share = std::min(1.0F, static_cast<float>(sharp * sharp / (radius * radius)));
    draw_disc(camera, *centre, radius,
              kAlbedo * share * light.of_particle(X_WC.p + from_lens_W, sky),
              static_cast<float>(p_C.norm()), distance, radiance);
  }
}

// Draws a disc with an edge one pixel wide.
void MarineSnow::draw_disc(const CameraModel& camera, const Eigen::Vector2d& centre,
                           double radius_px, float light, float far,
                           const std::vector<float>& distance, std::vector<float>& radiance) const {
  const double reach = radius_px + 0.5;
  const auto first = [&](double x) { return std::max(0, static_cast<int>(std::ceil(x - reach))); };
  const auto last = [&](double x, int size) {
    return std::min(size - 1, static_cast<int>(std::floor(x + reach)));
  };
  for (int v = first(centre.y()); v <= last(centre.y(), camera.height); ++v) {
    for (int u = first(centre.x()); u <= last(centre.x(), camera.width); ++u) {
      const auto i = static_cast<std::size_t>(v * camera.width + u);
      if (distance[i] < far) continue;
      const double off = std::hypot(u - centre.x(), v - centre.y());
      const double share = std::clamp(reach - off, 0.0, 1.0);
      radiance[i] += static_cast<float>(share) * light;
    }
  }
}

}  // namespace dive::vehicle
