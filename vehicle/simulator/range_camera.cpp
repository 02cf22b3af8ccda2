#include "vehicle/simulator/range_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include "common/assert.h"
#include "common/random.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/triangulation.h"

namespace dive::vehicle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kNoiseStream = 21;
constexpr std::uint64_t kParticleStream = 22;
constexpr double kSnowSide = 6.0;  // m, of the box of particles around the lens

struct DeviceRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct SceneRelease {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, DeviceRelease>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, SceneRelease>;

// Triangles, and which of them a ray meets first.
class TriangleScene {
 public:
  template <typename Vertices, typename Faces>
  void add(const Vertices& vertices, const Faces& faces) {
    const std::size_t before = vertices_.size();
    vertices_.insert(vertices_.end(), vertices.begin(), vertices.end());
    for (const auto& face : faces) {
      triangles_.push_back({static_cast<std::uint32_t>(before + face[0]),
                            static_cast<std::uint32_t>(before + face[1]),
                            static_cast<std::uint32_t>(before + face[2])});
    }
  }

  // After the last add().
  void build(RTCDevice device) {
    scene_.reset(rtcNewScene(device));
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);  // no ray slips between two triangles
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);
    if (!triangles_.empty()) attach(device);
    rtcCommitScene(scene_.get());
    DIVE_DEMAND(rtcGetDeviceError(device) == RTC_ERROR_NONE);
  }

  // Along the unit vector d from o, within [near, far]; infinity: nothing.
  [[nodiscard]] double range(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double near,
                             double far) const {
    RTCRayHit query{};
    query.ray.org_x = static_cast<float>(o.x());
    query.ray.org_y = static_cast<float>(o.y());
    query.ray.org_z = static_cast<float>(o.z());
    query.ray.dir_x = static_cast<float>(d.x());
    query.ray.dir_y = static_cast<float>(d.y());
    query.ray.dir_z = static_cast<float>(d.z());
    query.ray.tnear = static_cast<float>(near);
    query.ray.tfar = static_cast<float>(far);
    query.ray.mask = ~0U;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_.get(), &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return kInfinity;
    return to_triangle(triangles_[query.hit.primID], o, d, static_cast<double>(query.ray.tfar));
  }

 private:
  void attach(RTCDevice device) {
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* const corners = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), vertices_.size()));
    auto* const indices = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), triangles_.size()));
    DIVE_DEMAND(corners != nullptr && indices != nullptr);
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        corners[3 * i + k] = static_cast<float>(vertices_[i][static_cast<Eigen::Index>(k)]);
      }
    }
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      std::copy(triangles_[i].begin(), triangles_[i].end(), indices + 3 * i);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
  }

  // Embree's range has the last bits of whatever instructions the machine has; this one is the same
  // on all. They differ by more than rounding only where the ray grazes the triangle.
  [[nodiscard]] double to_triangle(const std::array<std::uint32_t, 3>& triangle,
                                   const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                                   double embree) const {
    constexpr double kRounding = 1e-3;  // m
    const Eigen::Vector3d& a = vertices_[triangle[0]];
    const Eigen::Vector3d normal = (vertices_[triangle[1]] - a).cross(vertices_[triangle[2]] - a);
    const double along = normal.dot(d);
    if (along == 0.0) return embree;
    return std::clamp(normal.dot(a - o) / along, embree - kRounding, embree + kRounding);
  }

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  Scene scene_;
};

// The faces of a convex solid, as the planes x . normal = offset, and a ball around it.
struct ConvexInside {
  ConvexInside(const TriangleSolid& solid, const Eigen::Vector3d& middle) : centre(middle) {
    for (const Eigen::Vector3d& vertex : solid.vertices) {
      radius = std::max(radius, (vertex - centre).norm());
    }
    for (const auto& [a, b, c] : solid.faces) {
      const Eigen::Vector3d& corner = solid.vertices[a];
      normals.push_back((solid.vertices[b] - corner).cross(solid.vertices[c] - corner));
      offsets.push_back(normals.back().dot(corner));
    }
  }

  [[nodiscard]] bool contains(const Eigen::Vector3d& p) const {
    if ((p - centre).norm() > radius) return false;
    for (std::size_t i = 0; i < normals.size(); ++i) {
      if (normals[i].dot(p) > offsets[i]) return false;
    }
    return true;
  }

  Eigen::Vector3d centre;
  double radius = 0.0;
  std::vector<Eigen::Vector3d> normals;
  std::vector<double> offsets;
};

TriangleSolid placed(const planning::Obstacle& obstacle) {
  TriangleSolid solid = circumscribed_solid(obstacle.shape);
  for (Eigen::Vector3d& vertex : solid.vertices) vertex = obstacle.X_WO * vertex;
  return solid;
}

// Marine snow without a memory: each particle drifts for ever through a space that repeats itself,
// and the copy that is seen is the one nearest to the lens. What leaves the box on one side enters
// on the other.
struct Particle {
  Eigen::Vector3d start;
  Eigen::Vector3d velocity;

  // From the lens, in W.
  [[nodiscard]] Eigen::Vector3d seen_from(const Eigen::Vector3d& lens_W, double t) const {
    const Eigen::Vector3d p = start + t * velocity - lens_W;
    return p - kSnowSide * (p / kSnowSide).array().round().matrix();
  }
};

std::vector<Particle> snow(const RangeCameraOptions& options, std::uint64_t seed) {
  Random random(seed, kParticleStream);
  const double count = std::round(options.particles_per_m3 * std::pow(kSnowSide, 3));
  std::vector<Particle> particles(static_cast<std::size_t>(count));
  for (auto& [start, velocity] : particles) {
    for (double& x : start) x = random.uniform(0.0, kSnowSide);
    for (double& x : velocity) x = random.normal();
    velocity *= options.particle_drift / velocity.norm();
  }
  return particles;
}

struct Bound {
  const char* name;
  double value;
  double low;
  double high;
};

}  // namespace

std::string RangeCameraOptions::validate() const {
  const std::array<Bound, 17> bounds{{
      {"width", static_cast<double>(width), 1, kMaxScanPoints},
      {"height", static_cast<double>(height), 1, kMaxScanPoints},
      {"pixels", static_cast<double>(width) * height, 1, kMaxScanPoints},
      {"horizontal_deg", horizontal_deg, 1, 170},
      {"vertical_deg", vertical_deg, 1, 170},
      {"tilt_deg", tilt_deg, -90, 90},
      {"origin_B.x", origin_B.x(), -10, 10},
      {"origin_B.y", origin_B.y(), -10, 10},
      {"origin_B.z", origin_B.z(), -10, 10},
      {"reach_m", reach_m, 0.1, 1000},
      {"rate_hz", rate_hz, 0.01, 1000},
      {"noise_m", noise_m, 0, 10},
      {"noise_share", noise_share, 0, 1},
      {"dropout_share", dropout_share, 0, 1},
      {"particles_per_m3", particles_per_m3, 0, 0.9},  // 194 of them
      {"particle_radius", particle_radius, 0, 0.1},
      {"particle_drift", particle_drift, 0, 10},
  }};
  for (const auto& [name, value, low, high] : bounds) {
    if (value >= low && value <= high) continue;  // false for NaN
    return fmt::format("{} is {} but must be from {} to {}", name, value, low, high);
  }
  return {};
}

struct RangeCamera::Impl {
  struct Plane {
    Eigen::Vector3d normal_W;  // out of the solid half
    double offset;             // normal . x of its surface
  };

  Impl(const planning::World& world, RangeCameraOptions options_, std::uint64_t seed)
      : options(std::move(options_)),
        noise(seed, kNoiseStream),
        half_width(std::tan(0.5 * deg_to_rad(options.horizontal_deg))),
        half_height(std::tan(0.5 * deg_to_rad(options.vertical_deg))),
        q_BC(from_rpy(0.0, deg_to_rad(options.tilt_deg), 0.0)),
        particles(snow(options, seed)),
        device(rtcNewDevice("threads=1")) {  // the order of its work is then always the same
    DIVE_DEMAND(device != nullptr);
    for (const planning::Obstacle& obstacle : world.obstacles) {
      if (obstacle.surface < 0 || world.surfaces.empty()) add(obstacle);
    }
    for (const planning::Surface& surface : world.surfaces) {
      walls.add(surface.mesh.vertices, surface.mesh.triangles);
    }
    walls.build(device.get());
    const TriangleSolid body = placed(Diver::shape());
    diver.add(body.vertices, body.faces);
    diver.build(device.get());
    diver_inside.emplace(body, Eigen::Vector3d::Zero());
    aim();
  }

  void add(const planning::Obstacle& obstacle) {
    if (const auto* half = std::get_if<planning::HalfSpace>(&obstacle.shape)) {
      const Eigen::Vector3d normal_W = obstacle.X_WO.q * half->normal.normalized();
      planes.push_back({normal_W, normal_W.dot(obstacle.X_WO.p)});
      return;
    }
    const TriangleSolid solid = placed(obstacle);
    walls.add(solid.vertices, solid.faces);
    solids.emplace_back(solid, obstacle.X_WO.p);
  }

  void aim() {
    for (int row = 0; row < options.height; ++row) {
      for (int column = 0; column < options.width; ++column) {
        rays_B.push_back(q_BC * image_point(column, row).normalized());
      }
    }
    ranges.resize(rays_B.size());
  }

  // The middle of a pixel on the image plane, x = 1 in C.
  [[nodiscard]] Eigen::Vector3d image_point(int column, int row) const {
    return {1.0, half_width * (1.0 - (2.0 * column + 1.0) / options.width),
            half_height * (1.0 - (2.0 * row + 1.0) / options.height)};
  }

  [[nodiscard]] bool is_covered(const Eigen::Vector3d& lens_W,
                                const std::optional<Pose>& X_DW) const {
    return std::any_of(planes.begin(), planes.end(),
                       [&](const Plane& p) { return p.normal_W.dot(lens_W) <= p.offset; }) ||
           std::any_of(solids.begin(), solids.end(),
                       [&](const ConvexInside& solid) { return solid.contains(lens_W); }) ||
           (X_DW && diver_inside->contains(*X_DW * lens_W));
  }

  // Of what is solid, along one ray; infinity: nothing, NaN: not looked.
  [[nodiscard]] double range(const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                             const std::optional<Pose>& X_DW) const {
    double near = 0.0;  // where the ray is in the water and within reach
    double far = options.reach_m;
    if (o.z() > 0.0) {
      near = d.z() < 0.0 ? -o.z() / d.z() : kInfinity;
      if (near >= far) return kNaN;
    } else if (d.z() > 0.0) {
      far = std::min(far, -o.z() / d.z());
    }
    double least = walls.range(o, d, near, far);
    if (X_DW) least = std::min(least, diver.range(*X_DW * o, X_DW->q * d, near, far));
    for (const Plane& plane : planes) {
      const double along = -plane.normal_W.dot(d);
      if (along <= 0.0) continue;
      const double t = (plane.normal_W.dot(o) - plane.offset) / along;
      if (t >= near && t <= far) least = std::min(least, t);
    }
    return least;
  }

  // How many scans have fallen due after the first.
  [[nodiscard]] std::int64_t sequence(Utime now) const {
    return static_cast<std::int64_t>(std::floor(to_seconds(now) * options.rate_hz + 1e-9));
  }

  [[nodiscard]] RangeScan take(Utime now, const Pose& X_WB, const std::optional<Pose>& X_WD) {
    last_sequence = sequence(now);
    std::optional<Pose> X_DW;
    if (X_WD) X_DW = X_WD->inverse();
    look(now, X_WB, X_DW);
    RangeScan scan{now, options.origin_B.cast<float>(), static_cast<float>(options.reach_m), {}};
    scan.points_B.reserve(ranges.size());
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      scan.points_B.emplace_back(
          (options.origin_B + measured(ranges[i]) * rays_B[i]).cast<float>());
    }
    return scan;
  }

  // Fills `ranges`, without noise.
  void look(Utime now, const Pose& X_WB, const std::optional<Pose>& X_DW) {
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
    for (const Particle& particle : particles) {
      const Eigen::Vector3d from_lens_W = particle.seen_from(lens_W, to_seconds(now));
      if (lens_W.z() + from_lens_W.z() < 0.0) drift_before(X_CW.q * from_lens_W);
    }
  }

  // A particle at p_C hides what lies behind it. All in the plane through it across the optical
  // axis, or on the image plane: there the same divided by its depth.
  void drift_before(const Eigen::Vector3d& p_C) {
    const double depth = p_C.x();
    if (depth <= options.particle_radius) return;
    const double pixel_width = 2.0 * half_width / options.width;
    const double pixel_height = 2.0 * half_height / options.height;
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
    const int last_row = end(half_height, image.z(), pixel_height, options.height);
    const int last_column = end(half_width, image.y(), pixel_width, options.width);
    for (int row = first(half_height, image.z(), pixel_height, options.height); row < last_row;
         ++row) {
      for (int column = first(half_width, image.y(), pixel_width, options.width);
           column < last_column; ++column) {
        const Eigen::Vector3d pixel = image_point(column, row);
        if ((pixel - image).norm() > radius) continue;
        double& range = ranges[static_cast<std::size_t>(row * options.width + column)];
        const double nearer = depth * pixel.norm();
        if (nearer < range && nearer <= options.reach_m) range = nearer;
      }
    }
  }

  // What the sensor makes of a range.
  [[nodiscard]] double measured(double range) {
    if (noise.uniform() < options.dropout_share || std::isnan(range)) return kNaN;
    if (range == kInfinity) return 2.0 * options.reach_m;
    // A surface stays one: rounded to floats, it is still told as within reach.
    const double most = (1.0 - 1e-6) * options.reach_m;
    const double sigma = options.noise_m + options.noise_share * range;
    return std::clamp(range + sigma * noise.normal(), 0.0, most);
  }

  RangeCameraOptions options;
  Random noise;
  double half_width;  // of the image plane, x = 1 in C
  double half_height;
  Eigen::Quaterniond q_BC;
  std::vector<Particle> particles;
  std::vector<Eigen::Vector3d> rays_B;
  Device device;
  TriangleScene walls;
  std::vector<ConvexInside> solids;
  std::vector<Plane> planes;
  TriangleScene diver;
  std::optional<ConvexInside> diver_inside;
  std::int64_t last_sequence = -1;
  std::vector<double> ranges;  // of this scan, by pixel; scratch
};

RangeCamera::RangeCamera(const planning::World& world, RangeCameraOptions options,
                         std::uint64_t seed) {
  DIVE_DEMAND(options.validate().empty());
  impl_ = std::make_unique<Impl>(world, std::move(options), seed);
}
RangeCamera::RangeCamera(RangeCamera&&) noexcept = default;
RangeCamera& RangeCamera::operator=(RangeCamera&&) noexcept = default;
RangeCamera::~RangeCamera() = default;

bool RangeCamera::due(Utime now) const { return impl_->sequence(now) > impl_->last_sequence; }

RangeScan RangeCamera::take(Utime now, const Pose& X_WB, const std::optional<Pose>& X_WD) {
  DIVE_DEMAND(X_WB.is_finite() && (!X_WD || X_WD->is_finite()));
  return impl_->take(now, X_WB, X_WD);
}

}  // namespace dive::vehicle
