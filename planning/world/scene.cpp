#include "planning/world/scene.h"

#include <algorithm>
#include <limits>

#include "planning/world/narrowphase.h"
#include "planning/world/primitives.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

struct Body {
  Eigen::Matrix3d R_WO;
  Vector3d p_WO;
  Shape shape;
  NarrowPhase narrow_phase;
};

}  // namespace

struct Scene::Impl {
  std::vector<Body> bodies;
  std::vector<Eigen::AlignedBox3d> boxes;  // Of the bodies, in W.
  std::vector<Vector3d> points_O;          // Scratch: the solid in an obstacle's frame.

  bool separation(std::size_t index, std::span<const Vector3d> points_W, double cutoff,
                  Contact& contact);
};

bool Scene::Impl::separation(std::size_t index, std::span<const Vector3d> points_W, double cutoff,
                             Contact& contact) {
  const Body& body = bodies[index];
  points_O.resize(points_W.size());
  for (std::size_t i = 0; i < points_W.size(); ++i) {
    points_O[i].noalias() = body.R_WO.transpose() * (points_W[i] - body.p_WO);
  }
  Separation separation;
  if (!body.narrow_phase.separation(points_O, cutoff, separation)) return false;
  contact.obstacle = static_cast<int>(index);
  contact.distance = separation.distance;
  contact.normal_W = body.R_WO * separation.normal;
  contact.point_on_solid_W = body.R_WO * separation.on_solid + body.p_WO;
  contact.point_on_obstacle_W = body.R_WO * separation.on_obstacle + body.p_WO;
  return true;
}

Scene::Scene(const World& world) : impl_(std::make_unique<Impl>()) {
  for (const Obstacle& obstacle : world.obstacles) {
    impl_->bodies.push_back({obstacle.X_WO.q.toRotationMatrix(), obstacle.X_WO.p, obstacle.shape,
                             NarrowPhase(obstacle.shape)});
    impl_->boxes.push_back(bounding_box(obstacle));
  }
}

Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

void Scene::contacts(std::span<const Vector3d> points_W, double cutoff, std::vector<Contact>& out) {
  out.clear();
  if (points_W.empty()) return;
  Eigen::AlignedBox3d solid;
  for (const Vector3d& p : points_W) solid.extend(p);
  const double reach = std::max(cutoff, 0.0);
  for (std::size_t i = 0; i < impl_->boxes.size(); ++i) {
    if (impl_->boxes[i].squaredExteriorDistance(solid) > reach * reach) continue;
    Contact contact;
    if (impl_->separation(i, points_W, cutoff, contact)) out.push_back(contact);
  }
}

double Scene::clearance(std::span<const Vector3d> points_W, double cutoff) {
  if (points_W.empty()) return cutoff;
  Eigen::AlignedBox3d solid;
  for (const Vector3d& p : points_W) solid.extend(p);
  double least = cutoff;
  for (std::size_t i = 0; i < impl_->boxes.size(); ++i) {
    const double gap = std::max(least, 0.0);
    if (impl_->boxes[i].squaredExteriorDistance(solid) > gap * gap) continue;
    Contact contact;
    if (impl_->separation(i, points_W, least, contact)) least = contact.distance;
  }
  return least;
}

double Scene::point_distance(const Vector3d& p_W) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < impl_->boxes.size(); ++i) {
    const double gap = std::max(least, 0.0);
    if (impl_->boxes[i].squaredExteriorDistance(p_W) > gap * gap) continue;
    const Body& body = impl_->bodies[i];
    least = std::min(least, signed_distance(body.shape, body.R_WO.transpose() * (p_W - body.p_WO)));
  }
  return least;
}

}  // namespace dive::planning
