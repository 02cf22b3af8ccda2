#include "planning/world/scene.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "planning/world/box_tree.h"
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
  BoxTree tree;                     // Over the bodies' boxes in W.
  std::vector<std::size_t> nearby;  // Scratch: what the broadphase found.
  SolidPoints points_W;             // Scratch: the solid ...
  SolidPoints points_O;             // ... and as an obstacle sees it.

  [[nodiscard]] Eigen::AlignedBox3d around() const { return {points_W.low(), points_W.high()}; }
  bool separation(std::size_t index, double cutoff, Contact& contact);
};

bool Scene::Impl::separation(std::size_t index, double cutoff, Contact& contact) {
  const Body& body = bodies[index];
  points_O.assign_seen_from(body.R_WO, body.p_WO, points_W);
  Separation separation;
  if (!body.narrow_phase.separation(points_O, cutoff, separation)) return false;
  contact.obstacle = static_cast<int>(index);
  contact.distance = separation.distance;
  contact.normal_W = body.R_WO * separation.normal;
  contact.point_on_solid_W = body.R_WO * separation.on_solid + body.p_WO;
  contact.point_on_obstacle_W = body.R_WO * separation.on_obstacle + body.p_WO;
  return true;
}

Scene::Scene(const World& world) {
  std::vector<Body> bodies;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Obstacle& obstacle : world.obstacles) {
    bodies.push_back({obstacle.X_WO.q.toRotationMatrix(), obstacle.X_WO.p, obstacle.shape,
                      NarrowPhase(obstacle.shape)});
    boxes.push_back(bounding_box(obstacle));
  }
  impl_.reset(new Impl{std::move(bodies), BoxTree(boxes), {}, {}, {}});
}

Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

void Scene::contacts(std::span<const Vector3d> points_W, double cutoff, std::vector<Contact>& out) {
  out.clear();
  if (points_W.empty()) return;
  const double reach = std::max(cutoff, 0.0);
  impl_->nearby.clear();
  impl_->points_W.assign(points_W);
  impl_->tree.visit(impl_->around(), reach, [&](std::size_t index) {
    impl_->nearby.push_back(index);
    return reach;
  });
  std::sort(impl_->nearby.begin(), impl_->nearby.end());
  for (const std::size_t index : impl_->nearby) {
    Contact contact;
    if (impl_->separation(index, cutoff, contact)) out.push_back(contact);
  }
}

double Scene::clearance(std::span<const Vector3d> points_W, double cutoff) {
  if (points_W.empty()) return cutoff;
  double least = cutoff;
  impl_->points_W.assign(points_W);
  impl_->tree.visit(impl_->around(), std::max(cutoff, 0.0), [&](std::size_t index) {
    Contact contact;
    if (impl_->separation(index, least, contact)) least = contact.distance;
    return std::max(least, 0.0);
  });
  return least;
}

double Scene::point_distance(const Vector3d& p_W) const {
  double least = std::numeric_limits<double>::infinity();
  impl_->tree.visit(p_W, least, [&](std::size_t index) {
    const Body& body = impl_->bodies[index];
    const Vector3d p_O = body.R_WO.transpose() * (p_W - body.p_WO);
    least = std::min(least, signed_distance(body.shape, p_O));
    return std::max(least, 0.0);
  });
  return least;
}

}  // namespace dive::planning
