#include "vehicle/simulator/cameras/visible_scene.h"

#include <cmath>

#include "vehicle/simulator/diver.h"

namespace dive::vehicle {
namespace {

constexpr std::uint32_t kDiver = VisibleScene::kOpen - 1U;
constexpr std::uint32_t kPrintWhite = VisibleScene::kOpen - 2U;
constexpr std::uint32_t kPrintBlack = VisibleScene::kOpen - 3U;
constexpr float kWhite = 0.7F;     // albedo of matt film
constexpr float kBlack = 0.05F;    // albedo of the print on it
constexpr float kGrazing = 0.02F;  // cosine: limits the stretching of a pixel to its inverse

}  // namespace

VisibleScene::VisibleScene(const planning::World& world, std::span<const Tag> tags)
    : traced_(world),
      diver_inside_(placed_solid(Diver::shape()), Eigen::Vector3d::Zero()),
      boards_(tags),
      sky_(traced_, world.bounds()) {
  for (std::size_t i = 0; i < traced_.triangles().size(); ++i) {
    const std::string& name = traced_.name_of_triangle(i);
    face_planes_.push_back(traced_.triangles().plane(i));
    faces_.push_back(face(face_planes_.back(), texture_of(name, false), tone_of(name)));
  }
  for (std::size_t i = 0; i < traced_.planes().size(); ++i) {
    const std::string& name = traced_.name_of_plane(i);
    face_planes_.push_back(traced_.planes()[i]);
    const bool is_ground = face_planes_.back().normal.z() > 0.7;
    faces_.push_back(face(face_planes_.back(), texture_of(name, is_ground), tone_of(name)));
  }
  diver_.add(placed_solid(Diver::shape()));
  diver_.build();
}

VisibleScene::Face VisibleScene::face(const TracedPlane& plane, Texture texture, float tone) {
  const Eigen::Vector3f n = plane.normal.cast<float>();
  return {n.x(), n.y(), n.z(), tone, static_cast<std::int32_t>(texture)};
}

bool VisibleScene::covers(const Eigen::Vector3d& p_W, const std::optional<Pose>& X_DW) const {
  return traced_.covers(p_W) || (X_DW && diver_inside_.contains(*X_DW * p_W));
}

// Distances and ids. Embree gives the triangle; the point on it is computed here in doubles.
void VisibleScene::find(const Eigen::Vector3d& o, const TriangleScene::Packet& packet,
                        std::size_t first, std::size_t count, RayBatch& rays, Ids& ids) const {
  const std::size_t triangles = traced_.triangles().size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = first + k;
    const Eigen::Vector3d d = Eigen::Vector3f(rays.dx[i], rays.dy[i], rays.dz[i]).cast<double>();
    double distance = kReach;
    if (o.z() + kReach * d.z() > 0.0) distance = std::max(0.0, -o.z() / d.z());  // the surface
    std::uint32_t id = kOpen;
    const auto try_face = [&](std::size_t face, double along) {
      const TracedPlane& plane = face_planes_[face];
      const double t = (plane.offset - plane.normal.dot(o)) / along;
      if (!(t >= 0.0 && t < distance)) return;
      distance = t;
      id = static_cast<std::uint32_t>(face);
    };
    if (packet.triangle[k] != TriangleScene::kNothing) {
      try_face(packet.triangle[k], face_planes_[packet.triangle[k]].normal.dot(d));
    }
    for (std::size_t face = triangles; face < face_planes_.size(); ++face) {
      const double along = face_planes_[face].normal.dot(d);
      if (along < 0.0) try_face(face, along);
    }
    ids[i] = id;
    rays.distance[i] = static_cast<float>(distance);
  }
}

// Through the water's surface the sky is visible in Snell's window; around it total reflection
// mirrors the water below, which is taken as dark.
void VisibleScene::fill_open(const Eigen::Vector3d& o, RayBatch& rays, std::size_t i) {
  const float up = rays.dz[i];
  const bool is_surface = o.z() + kReach * static_cast<double>(up) > 0.0;
  if (!is_surface) rays.distance[i] = RayBatch::kFar;
  rays.glow[i] = is_surface ? smooth_step(0.62F, 0.70F, up) : 0.0F;
  rays.nx[i] = rays.ny[i] = rays.nz[i] = 0.0F;
  rays.texture[i] = 0;
  rays.tone[i] = 1.0F;
  rays.footprint[i] = RayBatch::kFar;
}

void VisibleScene::fill(const Eigen::Vector3d& o, double radians_per_px, const Ids& ids,
                        RayBatch& rays) const {
  const auto ox = static_cast<float>(o.x());
  const auto oy = static_cast<float>(o.y());
  const auto oz = static_cast<float>(o.z());
  const auto width = static_cast<float>(radians_per_px);
  for (std::size_t i = 0; i < static_cast<std::size_t>(rays.count); ++i) {
    if (ids[i] == kOpen) {
      fill_open(o, rays, i);
      continue;
    }
    const Face& face = faces_[ids[i]];
    const float along = face.nx * rays.dx[i] + face.ny * rays.dy[i] + face.nz * rays.dz[i];
    const float side = along > 0.0F ? -1.0F : 1.0F;
    rays.nx[i] = side * face.nx;
    rays.ny[i] = side * face.ny;
    rays.nz[i] = side * face.nz;
    rays.texture[i] = face.texture;
    rays.tone[i] = face.tone;
    rays.glow[i] = 0.0F;
    rays.footprint[i] = width * rays.distance[i] / std::max(kGrazing, -side * along);
  }
  for (std::size_t i = 0; i < RayBatch::kSize; ++i) {
    rays.tx[i] = ox + rays.distance[i] * rays.dx[i];
    rays.ty[i] = oy + rays.distance[i] * rays.dy[i];
    rays.tz[i] = oz + rays.distance[i] * rays.dz[i];
  }
}

void VisibleScene::meet(const Eigen::Vector3d& o, double radians_per_px,
                        const std::optional<Pose>& X_DW, RayBatch& rays, Ids& ids) const {
  TriangleScene::Packet packet;
  const auto size = static_cast<std::size_t>(rays.count);
  for (std::size_t first = 0; first < size; first += TriangleScene::kPacket) {
    std::copy_n(rays.dx.data() + first, TriangleScene::kPacket, packet.dx.data());
    std::copy_n(rays.dy.data() + first, TriangleScene::kPacket, packet.dy.data());
    std::copy_n(rays.dz.data() + first, TriangleScene::kPacket, packet.dz.data());
    const std::size_t count = std::min<std::size_t>(TriangleScene::kPacket, size - first);
    traced_.triangles().trace(o, kReach, static_cast<int>(count), packet);
    find(o, packet, first, count, rays, ids);
  }
  fill(o, radians_per_px, ids, rays);
  if (!boards_.empty()) add_boards(o, radians_per_px, rays, ids);
  if (X_DW) add_diver(o, radians_per_px, *X_DW, rays, ids);
  sky_.fill(o, rays);
}

// Black and white differ in id, so that the border between them counts as an edge and is smoothed.
void VisibleScene::add_boards(const Eigen::Vector3d& o, double radians_per_px, RayBatch& rays,
                              Ids& ids) const {
  for (std::size_t i = 0; i < static_cast<std::size_t>(rays.count); ++i) {
    const Eigen::Vector3d d =
        Eigen::Vector3f(rays.dx[i], rays.dy[i], rays.dz[i]).cast<double>().normalized();
    const auto before = static_cast<double>(rays.distance[i]);
    const std::optional<TagBoards::Met> met = boards_.meet(o, d, std::min(before, kReach));
    if (!met) continue;
    const Eigen::Vector3f n = met->normal_W.cast<float>();
    const auto cosine = static_cast<float>(std::abs(met->normal_W.dot(d)));
    rays.distance[i] = static_cast<float>(met->distance);
    rays.nx[i] = n.x();
    rays.ny[i] = n.y();
    rays.nz[i] = n.z();
    rays.footprint[i] =
        static_cast<float>(radians_per_px * met->distance) / std::max(kGrazing, cosine);
    rays.texture[i] = static_cast<std::int32_t>(Texture::kPrint);
    rays.tone[i] = met->is_white ? kWhite : kBlack;
    rays.glow[i] = 0.0F;
    ids[i] = met->is_white ? kPrintWhite : kPrintBlack;
  }
}

// The texture of the suit is fixed in the diver's frame.
void VisibleScene::add_diver(const Eigen::Vector3d& o, double radians_per_px, const Pose& X_DW,
                             RayBatch& rays, Ids& ids) const {
  const Eigen::Vector3d o_D = X_DW * o;
  const Eigen::Matrix3d R_DW = X_DW.q.toRotationMatrix();
  for (std::size_t i = 0; i < static_cast<std::size_t>(rays.count); ++i) {
    const Eigen::Vector3d d_D =
        R_DW * Eigen::Vector3f(rays.dx[i], rays.dy[i], rays.dz[i]).cast<double>();
    const auto before = static_cast<double>(rays.distance[i]);
    const double range = diver_.range(o_D, d_D, 0.0, std::min(before, kReach));
    if (!(range < before)) continue;
    const Eigen::Vector3d p_D = o_D + range * d_D;
    // The shape is a capsule about x: its normal points away from the axis.
    const Eigen::Vector3d axis_D(std::clamp(p_D.x(), -0.5 * Diver::kLength, 0.5 * Diver::kLength),
                                 0.0, 0.0);
    const Eigen::Vector3d n_D = (p_D - axis_D).normalized();
    const Eigen::Vector3f n_W = (R_DW.transpose() * n_D).cast<float>();
    const auto cosine = static_cast<float>(std::abs(n_D.dot(d_D)));
    rays.distance[i] = static_cast<float>(range);
    rays.nx[i] = n_W.x();
    rays.ny[i] = n_W.y();
    rays.nz[i] = n_W.z();
    rays.tx[i] = static_cast<float>(p_D.x());
    rays.ty[i] = static_cast<float>(p_D.y());
    rays.tz[i] = static_cast<float>(p_D.z());
    rays.footprint[i] = static_cast<float>(radians_per_px * range) / std::max(kGrazing, cosine);
    rays.texture[i] = static_cast<std::int32_t>(Texture::kSuit);
    rays.tone[i] = 1.0F;
    rays.glow[i] = 0.0F;
    ids[i] = kDiver;
  }
}

bool VisibleScene::continues(std::uint32_t id, const Eigen::Vector3d& p_W, double tolerance) const {
  if (id >= face_planes_.size()) return false;
  const TracedPlane& plane = face_planes_[id];
  return std::abs(plane.normal.dot(p_W) - plane.offset) < tolerance;
}

}  // namespace dive::vehicle
