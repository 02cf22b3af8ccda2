#include "vehicle/simulator/sensors/range_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/assert.h"
#include "common/random.h"
#include "common/range_check.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/ray_tracing/traced_world.h"
#include "vehicle/simulator/water/drifter.h"

namespace dive::vehicle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kNoiseStream = 21;
constexpr std::uint64_t kParticleStream = 22;
constexpr std::uint64_t kMountStream = 23;
constexpr double kSnowSide = 6.0;  // m, side of the box of particles around the lens

std::vector<Drifter> snow(const RangeCameraOptions& options, std::uint64_t seed) {
  Random random(seed, kParticleStream);
  const double count = std::round(options.particles_per_m3 * std::pow(kSnowSide, 3));
  std::vector<Drifter> particles;
  for (double i = 0.0; i < count; ++i) {
    particles.push_back(Drifter::draw(random, kSnowSide, options.particle_drift));
  }
  return particles;
}

}  // namespace

std::string RangeCameraOptions::validate() const {
  RangeCheck check;
  check("width", static_cast<double>(width), 1, kMaxScanPoints);
  check("height", static_cast<double>(height), 1, kMaxScanPoints);
  check("pixels", static_cast<double>(width) * height, 1, kMaxScanPoints);
  check("horizontal_deg", horizontal_deg, 1, 170);
  check("vertical_deg", vertical_deg, 1, 170);
  check("tilt_deg", tilt_deg, -90, 90);
  check("origin_B.x", origin_B.x(), -10, 10);
  check("origin_B.y", origin_B.y(), -10, 10);
  check("origin_B.z", origin_B.z(), -10, 10);
  for (const double angle : misalignment_deg) check("misalignment_deg", angle, -90, 90);
  check("reach_m", reach_m, 0.1, 1000);
  check("rate_hz", rate_hz, 0.01, 1000);
  check("noise_m", noise_m, 0, 10);
  check("noise_share", noise_share, 0, 1);
  check("dropout_share", dropout_share, 0, 1);
  check("particles_per_m3", particles_per_m3, 0, 0.9);  // at most 194 particles
  check("particle_radius", particle_radius, 0, 0.1);
  check("particle_drift", particle_drift, 0, 10);
  return check.problem();
}

RangeCameraOptions drawn_range_camera(RangeCameraOptions options, double sigma_deg,
                                      std::uint64_t seed) {
  Random random(seed, kMountStream);
  for (double& angle : options.misalignment_deg) angle += sigma_deg * random.normal();
  return options;
}

struct RangeCamera::Impl {
  Impl(const planning::World& world, RangeCameraOptions options_, std::uint64_t seed)
      : options(std::move(options_)),
        noise(seed, kNoiseStream),
        grid(options, options.width, options.height),
        q_BC(options.q_BC() * from_rpy(deg_to_rad(options.misalignment_deg.x()),
                                       deg_to_rad(options.misalignment_deg.y()),
                                       deg_to_rad(options.misalignment_deg.z()))),
        particles(snow(options, seed)),
        walls(world),
        diver_inside(placed_solid(Diver::shape()), Eigen::Vector3d::Zero()) {
    diver.add(placed_solid(Diver::shape()));
    diver.build();
    aim();
  }

  void aim() {
    const Eigen::Quaterniond q_reported = options.q_BC();
    for (int row = 0; row < options.height; ++row) {
      for (int column = 0; column < options.width; ++column) {
        const Eigen::Vector3d ray_C = grid.centre(column, row).normalized();
        rays_B.push_back(q_BC * ray_C);
        reported_B.push_back(q_reported * ray_C);
      }
    }
    ranges.resize(rays_B.size());
  }

  [[nodiscard]] bool is_covered(const Eigen::Vector3d& lens_W,
                                const std::optional<Pose>& X_DW) const {
    const auto covers = [&](const TracedWorld& world) { return world.covers(lens_W); };
    return covers(walls) || std::ranges::any_of(appeared, covers) ||
           (X_DW && diver_inside.contains(*X_DW * lens_W));
  }

  // Range of the first solid along one ray; infinity: none, NaN: no measurement.
  [[nodiscard]] double range(const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                             const std::optional<Pose>& X_DW) const {
    double near = 0.0;  // part of the ray that is in the water and within reach
    double far = options.reach_m;
    if (o.z() > 0.0) {
      near = d.z() < 0.0 ? -o.z() / d.z() : kInfinity;
      if (near >= far) return kNaN;
    } else if (d.z() > 0.0) {
      far = std::min(far, -o.z() / d.z());
    }
    double least = walls.range(o, d, near, far);
    for (const TracedWorld& world : appeared) {
      least = std::min(least, world.range(o, d, near, far));
    }
    if (X_DW) least = std::min(least, diver.range(*X_DW * o, X_DW->q * d, near, far));
    return least;
  }

  // Number of scans that were due after the first.
  [[nodiscard]] std::int64_t sequence(Utime now) const {
    return static_cast<std::int64_t>(std::floor(to_seconds(now) * options.rate_hz + 1e-9));
  }

  [[nodiscard]] RangeScan take(Utime now, const Pose& X_WB, const std::optional<Pose>& X_WD) {
    last_sequence = sequence(now);
    std::optional<Pose> X_DW;
    if (X_WD) X_DW = X_WD->inverse();
    measure_ranges(now, X_WB, X_DW);
    RangeScan scan{now, options.origin_B.cast<float>(), static_cast<float>(options.reach_m), {}};
    scan.points_B.reserve(ranges.size());
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      scan.points_B.emplace_back(
          (options.origin_B + measured(ranges[i]) * reported_B[i]).cast<float>());
    }
    return scan;
  }

  // Fills `ranges`, without noise.
  void measure_ranges(Utime now, const Pose& X_WB, const std::optional<Pose>& X_DW) {
    const Eigen::Vector3d lens_W = X_WB * options.origin_B;
    if (is_covered(lens_W, X_DW)) {
      std::fill(ranges.begin(), ranges.end(), kNaN);
      return;
    }
    const Eigen::Matrix3d R_WB = X_WB.q.toRotationMatrix();
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      ranges[i] = range(lens_W, R_WB * rays_B[i], X_DW);
    }
    const Pose X_CW = (X_WB * Pose{options.origin_B, q_BC}).inverse();
    for (const Drifter& particle : particles) {
      const Eigen::Vector3d from_lens_W = particle.from_lens(lens_W, to_seconds(now), kSnowSide);
      if (lens_W.z() + from_lens_W.z() < 0.0) drift_before(X_CW.q * from_lens_W);
    }
  }

  // Shortens the ranges of the pixels whose rays a particle at p_C blocks. Computed in the plane
  // through it across the optical axis, or, divided by its depth, on the image plane.
  void drift_before(const Eigen::Vector3d& p_C) {
    const double depth = p_C.x();
    if (depth <= options.particle_radius) return;
    const double pixel_width = 2.0 * grid.half_width() / options.width;
    const double pixel_height = 2.0 * grid.half_height() / options.height;
    const double radius = options.particle_radius / depth + 0.5 * pixel_width;
    const Eigen::Vector3d image = p_C / depth;
    const auto first = [&](double edge, double p, double size, int count) {
      return static_cast<int>(
          std::clamp(std::ceil((edge - p - radius) / size - 0.5), 0.0, 1.0 * count));
    };
    const auto end = [&](double edge, double p, double size, int count) {
      return static_cast<int>(
          std::clamp(std::floor((edge - p + radius) / size - 0.5) + 1.0, 0.0, 1.0 * count));
    };
    const int last_row = end(grid.half_height(), image.z(), pixel_height, options.height);
    const int last_column = end(grid.half_width(), image.y(), pixel_width, options.width);
    for (int row = first(grid.half_height(), image.z(), pixel_height, options.height);
         row < last_row; ++row) {
      for (int column = first(grid.half_width(), image.y(), pixel_width, options.width);
           column < last_column; ++column) {
        const Eigen::Vector3d pixel = grid.centre(column, row);
        if ((pixel - image).norm() > radius) continue;
        double& range = ranges[static_cast<std::size_t>(row * options.width + column)];
        const double nearer = depth * pixel.norm();
        if (nearer < range && nearer <= options.reach_m) range = nearer;
      }
    }
  }

  // The measured value of a true range.
  [[nodiscard]] double measured(double range) {
    if (noise.uniform() < options.dropout_share || std::isnan(range)) return kNaN;
    if (range == kInfinity) return 2.0 * options.reach_m;
    // A surface within reach stays within reach after rounding to floats.
    const double most = (1.0 - 1e-6) * options.reach_m;
    const double sigma = options.noise_m + options.noise_share * range;
    return std::clamp(range + sigma * noise.normal(), 0.0, most);
  }

  RangeCameraOptions options;
  Random noise;
  PixelGrid grid;
  Eigen::Quaterniond q_BC;
  std::vector<Drifter> particles;
  std::vector<Eigen::Vector3d> rays_B;
  std::vector<Eigen::Vector3d> reported_B;  ///< The same without misalignment.
  TracedWorld walls;
  std::vector<TracedWorld> appeared;
  TriangleScene diver;
  ConvexInside diver_inside;
  std::int64_t last_sequence = -1;
  bool is_frozen = false;
  std::optional<RangeScan> last;  ///< The repeated scan while frozen.
  std::vector<double> ranges;     // ranges of this scan, by pixel; scratch
};

RangeCamera::RangeCamera(const planning::World& world, RangeCameraOptions options,
                         std::uint64_t seed) {
  DIVE_DEMAND(options.validate().empty());
  impl_ = std::make_unique<Impl>(world, std::move(options), seed);
}
RangeCamera::RangeCamera(RangeCamera&&) noexcept = default;
RangeCamera& RangeCamera::operator=(RangeCamera&&) noexcept = default;
RangeCamera::~RangeCamera() = default;

void RangeCamera::add(const planning::World& appeared) { impl_->appeared.emplace_back(appeared); }

bool RangeCamera::due(Utime now) const { return impl_->sequence(now) > impl_->last_sequence; }

RangeScan RangeCamera::take(Utime now, const Pose& X_WB, const std::optional<Pose>& X_WD) {
  DIVE_DEMAND(X_WB.is_finite() && (!X_WD || X_WD->is_finite()));
  Impl& impl = *impl_;
  if (impl.is_frozen && impl.last) {
    impl.last_sequence = impl.sequence(now);
    impl.last->utime = now;
    return *impl.last;
  }
  RangeScan scan = impl.take(now, X_WB, X_WD);
  if (impl.is_frozen) impl.last = scan;
  return scan;
}

void RangeCamera::set_frozen(bool frozen) {
  impl_->is_frozen = frozen;
  if (!frozen) impl_->last.reset();
}

}  // namespace dive::vehicle
