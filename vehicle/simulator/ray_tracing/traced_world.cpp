#include "vehicle/simulator/ray_tracing/traced_world.h"

#include <algorithm>
#include <type_traits>
#include <variant>

#include <embree3/rtcore.h>

#include "common/assert.h"
#include "vehicle/simulator/ray_tracing/triangulation.h"

namespace dive::vehicle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct DeviceRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct SceneRelease {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, DeviceRelease>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, SceneRelease>;

}  // namespace

struct TriangleScene::Impl {
  // One thread makes the order of work deterministic.
  Impl() : device(rtcNewDevice("threads=1")) { DIVE_DEMAND(device != nullptr); }

  void build() {
    scene.reset(rtcNewScene(device.get()));
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);  // no ray slips between two triangles
    rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_HIGH);
    if (!triangles.empty()) attach();
    rtcCommitScene(scene.get());
    DIVE_DEMAND(rtcGetDeviceError(device.get()) == RTC_ERROR_NONE);
  }

  void attach() {
    const RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* const corners = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), vertices.size()));
    auto* const indices = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), triangles.size()));
    DIVE_DEMAND(corners != nullptr && indices != nullptr);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        corners[3 * i + k] = static_cast<float>(vertices[i][static_cast<Eigen::Index>(k)]);
      }
    }
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      std::copy(triangles[i].begin(), triangles[i].end(), indices + 3 * i);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene.get(), geometry);
    rtcReleaseGeometry(geometry);
  }

  [[nodiscard]] Eigen::Vector3d normal(const std::array<std::uint32_t, 3>& triangle) const {
    const Eigen::Vector3d& a = vertices[triangle[0]];
    return (vertices[triangle[1]] - a).cross(vertices[triangle[2]] - a);
  }

  // The last bits of Embree's range depend on the machine's instruction set; these do not. The two
  // differ by more than rounding only where the ray grazes the triangle.
  [[nodiscard]] double to_triangle(const std::array<std::uint32_t, 3>& triangle,
                                   const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                                   double embree) const {
    constexpr double kRounding = 1e-3;  // m
    const Eigen::Vector3d n = normal(triangle);
    const double along = n.dot(d);
    if (along == 0.0) return embree;
    return std::clamp(n.dot(vertices[triangle[0]] - o) / along, embree - kRounding,
                      embree + kRounding);
  }

  Device device;
  Scene scene;  // released before its device
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

TriangleScene::TriangleScene() : impl_(std::make_unique<Impl>()) {}
TriangleScene::TriangleScene(TriangleScene&&) noexcept = default;
TriangleScene& TriangleScene::operator=(TriangleScene&&) noexcept = default;
TriangleScene::~TriangleScene() = default;

void TriangleScene::add(std::span<const Eigen::Vector3d> vertices,
                        std::span<const std::array<std::uint32_t, 3>> faces) {
  const auto before = static_cast<std::uint32_t>(impl_->vertices.size());
  impl_->vertices.insert(impl_->vertices.end(), vertices.begin(), vertices.end());
  for (const auto& [a, b, c] : faces) {
    impl_->triangles.push_back({before + a, before + b, before + c});
  }
}

void TriangleScene::add(const TriangleSolid& solid) {
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (const auto& [a, b, c] : solid.faces) {
    faces.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b),
                     static_cast<std::uint32_t>(c)});
  }
  add(solid.vertices, faces);
}

void TriangleScene::build() { impl_->build(); }

std::size_t TriangleScene::size() const { return impl_->triangles.size(); }

TracedPlane TriangleScene::plane(std::size_t triangle) const {
  const auto& corners = impl_->triangles[triangle];
  const Eigen::Vector3d normal = impl_->normal(corners).normalized();  // zero stays zero
  return {normal, normal.dot(impl_->vertices[corners[0]])};
}

double TriangleScene::range(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double near,
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
  rtcIntersect1(impl_->scene.get(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return kInfinity;
  return impl_->to_triangle(impl_->triangles[query.hit.primID], o, d,
                            static_cast<double>(query.ray.tfar));
}

void TriangleScene::trace(const Eigen::Vector3d& o, double far, int count, Packet& packet) const {
  static_assert(kNothing == RTC_INVALID_GEOMETRY_ID);
  alignas(64) RTCRayHit16 query;
  alignas(64) std::array<int, kPacket> valid;
  for (int i = 0; i < kPacket; ++i) {
    const auto k = static_cast<std::size_t>(i);
    valid[k] = i < count ? -1 : 0;
    query.ray.org_x[k] = static_cast<float>(o.x());
    query.ray.org_y[k] = static_cast<float>(o.y());
    query.ray.org_z[k] = static_cast<float>(o.z());
    query.ray.tnear[k] = 0.0F;
    query.ray.tfar[k] = static_cast<float>(far);
    query.ray.time[k] = 0.0F;
    query.ray.mask[k] = ~0U;
    query.ray.flags[k] = 0;
    query.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    query.hit.primID[k] = kNothing;
  }
  std::copy(packet.dx.begin(), packet.dx.end(), query.ray.dir_x);
  std::copy(packet.dy.begin(), packet.dy.end(), query.ray.dir_y);
  std::copy(packet.dz.begin(), packet.dz.end(), query.ray.dir_z);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid.data(), impl_->scene.get(), &context, &query);
  std::copy(std::begin(query.hit.primID), std::end(query.hit.primID), packet.triangle.begin());
}

ConvexInside::ConvexInside(const TriangleSolid& solid, const Eigen::Vector3d& middle)
    : centre_(middle) {
  for (const Eigen::Vector3d& vertex : solid.vertices) {
    radius_ = std::max(radius_, (vertex - centre_).norm());
  }
  for (const auto& [a, b, c] : solid.faces) {
    const Eigen::Vector3d& corner = solid.vertices[a];
    const Eigen::Vector3d normal =
        (solid.vertices[b] - corner)
            .cross(solid.vertices[c] - corner);  // its length does not matter
    faces_.push_back({normal, normal.dot(corner)});
  }
}

bool ConvexInside::contains(const Eigen::Vector3d& p) const {
  if ((p - centre_).norm() > radius_) return false;
  return std::all_of(faces_.begin(), faces_.end(),
                     [&](const TracedPlane& face) { return face.normal.dot(p) <= face.offset; });
}

TriangleSolid placed_solid(const planning::Obstacle& obstacle) {
  TriangleSolid solid = circumscribed_solid(obstacle.shape);
  for (Eigen::Vector3d& vertex : solid.vertices) vertex = obstacle.X_WO * vertex;
  return solid;
}

TracedWorld::TracedWorld(const planning::World& world) {
  for (const planning::Obstacle& obstacle : world.obstacles) {
    if (obstacle.surface < 0 || world.surfaces.empty()) add(obstacle);
  }
  for (const planning::Surface& surface : world.surfaces) {
    triangles_.add(surface.mesh.vertices, surface.mesh.triangles);
    names_.push_back(surface.name);
    ends_.push_back(triangles_.size());
  }
  triangles_.build();
}

void TracedWorld::add(const planning::Obstacle& obstacle) {
  if (const auto* half = std::get_if<planning::HalfSpace>(&obstacle.shape)) {
    const Eigen::Vector3d normal_W = obstacle.X_WO.q * half->normal.normalized();
    planes_.push_back({normal_W, normal_W.dot(obstacle.X_WO.p)});
    plane_names_.push_back(obstacle.name);
    return;
  }
  const TriangleSolid solid = placed_solid(obstacle);
  triangles_.add(solid);
  names_.push_back(obstacle.name);
  ends_.push_back(triangles_.size());
  solids_.emplace_back(solid, obstacle.X_WO.p);
}

const std::string& TracedWorld::name_of_triangle(std::size_t triangle) const {
  const auto run = std::upper_bound(ends_.begin(), ends_.end(), triangle);
  DIVE_DEMAND(run != ends_.end());
  return names_[static_cast<std::size_t>(run - ends_.begin())];
}

bool TracedWorld::covers(const Eigen::Vector3d& p_W) const {
  return std::any_of(planes_.begin(), planes_.end(),
                     [&](const TracedPlane& p) { return p.normal.dot(p_W) <= p.offset; }) ||
         std::any_of(solids_.begin(), solids_.end(),
                     [&](const ConvexInside& solid) { return solid.contains(p_W); });
}

double TracedWorld::range(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double near,
                          double far) const {
  double least = triangles_.range(o, d, near, far);
  for (const TracedPlane& plane : planes_) {
    const double along = -plane.normal.dot(d);
    if (along <= 0.0) continue;
    const double t = (plane.normal.dot(o) - plane.offset) / along;
    if (t >= near && t <= far) least = std::min(least, t);
  }
  return least;
}

}  // namespace dive::vehicle
