#include "planning/world/scene.h"

#include <algorithm>
#include <cmath>
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
  NarrowPhase narrow_phase;
};

struct Solids {
  std::vector<Body> bodies;
  BoxTree tree;  // Tree of the bodies' boxes in W.
};

}  // namespace

struct Scene::Impl {
  std::shared_ptr<const Solids> solids;
  std::vector<std::size_t> nearby = {};  // Scratch: candidates from the broadphase.
  SolidPoints points_W = {};             // Scratch: the solid in W.
  SolidPoints points_O = {};             // Scratch: the solid in an obstacle's frame.
  Vector3d centre_W = Vector3d::Zero();  // Centre of a ball that contains the solid.
  double radius = 0.0;                   // Radius of that ball, m.

  [[nodiscard]] Eigen::AlignedBox3d around() const { return {points_W.low(), points_W.high()}; }
  void place(std::span<const Vector3d> solid_W);
  [[nodiscard]] bool is_beyond(const Body& body, double cutoff) const;
  bool separation(std::size_t index, double cutoff, Contact& contact);
};

void Scene::Impl::place(std::span<const Vector3d> solid_W) {
  points_W.assign(solid_W);
  centre_W = 0.5 * (points_W.low() + points_W.high());
  double squared = 0.0;
  for (const Vector3d& p : solid_W) squared = std::max(squared, (p - centre_W).squaredNorm());
  radius = std::sqrt(squared);
}

// The ball around the solid excludes most pairs whose boxes are near. Not worth it if the distance
// of its centre has no closed form.
bool Scene::Impl::is_beyond(const Body& body, double cutoff) const {
  if (std::holds_alternative<Polytope>(body.narrow_phase.shape())) return false;
  const Vector3d centre_O = body.R_WO.transpose() * (centre_W - body.p_WO);
  const double apart = signed_distance(body.narrow_phase.shape(), centre_O) - radius;
  return apart > 0.0 && apart >= cutoff;
}

bool Scene::Impl::separation(std::size_t index, double cutoff, Contact& contact) {
  const Body& body = solids->bodies[index];
  if (is_beyond(body, cutoff)) return false;
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
  bodies.reserve(world.obstacles.size());
  boxes.reserve(world.obstacles.size());
  for (const Obstacle& obstacle : world.obstacles) {
    bodies.push_back(
        {obstacle.X_WO.q.toRotationMatrix(), obstacle.X_WO.p, NarrowPhase(obstacle.shape)});
    boxes.push_back(bounding_box(obstacle));
  }
  impl_.reset(new Impl{std::make_shared<const Solids>(Solids{std::move(bodies), BoxTree(boxes)})});
}

Scene::Scene(const Scene& other) : impl_(new Impl{other.impl_->solids}) {}

Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

void Scene::reserve(std::size_t points) {
  const std::vector<Vector3d> solid(points, Vector3d::Zero());
  impl_->points_W.assign(solid);
  impl_->points_O.assign(solid);
  impl_->nearby.reserve(impl_->solids->bodies.size());
}

void Scene::contacts(std::span<const Vector3d> points_W, double cutoff, std::vector<Contact>& out) {
  out.clear();
  if (points_W.empty()) return;
  const double reach = std::max(cutoff, 0.0);
  impl_->nearby.clear();
  impl_->place(points_W);
  impl_->solids->tree.visit(impl_->around(), reach, [&](std::size_t index) {
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
  impl_->place(points_W);
  impl_->solids->tree.visit(impl_->around(), std::max(cutoff, 0.0), [&](std::size_t index) {
    Contact contact;
    if (impl_->separation(index, least, contact)) least = contact.distance;
    return std::max(least, 0.0);
  });
  return least;
}

double Scene::point_distance(const Vector3d& p_W) const {
  double least = std::numeric_limits<double>::infinity();
  impl_->solids->tree.visit(p_W, least, [&](std::size_t index) {
    const Body& body = impl_->solids->bodies[index];
    const Vector3d p_O = body.R_WO.transpose() * (p_W - body.p_WO);
    least = std::min(least, signed_distance(body.narrow_phase.shape(), p_O));
    return std::max(least, 0.0);
  });
  return least;
}

}  // namespace dive::planning
