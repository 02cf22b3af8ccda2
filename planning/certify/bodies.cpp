#include "planning/certify/bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/detail/convexity_based_algorithm/gjk_libccd.h>

#include "common/assert.h"

namespace dive::planning::certify {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTouching = 1e-6;  // m; closer points define no direction
// m; allowed gap between FCL's distance and the separation along its direction
constexpr double kMaxDiscrepancy = 1e-4;

using FclShape = std::variant<std::monostate, fcl::Boxd, fcl::Cylinderd, fcl::Sphered,
                              fcl::Capsuled, fcl::Ellipsoidd, fcl::Convexd>;

// Largest n . x over a shape in its own frame.
double reach_in_frame(const Box& s, const Vector3d& n) { return s.size.dot(n.cwiseAbs()) / 2.0; }
double reach_in_frame(const Cylinder& s, const Vector3d& n) {
  return s.radius * n.head<2>().norm() + s.length / 2.0 * std::abs(n.z());
}
double reach_in_frame(const Sphere& s, const Vector3d& n) { return s.radius * n.norm(); }
double reach_in_frame(const Capsule& s, const Vector3d& n) {
  return s.radius * n.norm() + s.length / 2.0 * std::abs(n.z());
}
double reach_in_frame(const Ellipsoid& s, const Vector3d& n) {
  return s.radii.cwiseProduct(n).norm();
}
double reach_in_frame(const Polytope& s, const Vector3d& n) {
  double farthest = -kInfinity;
  for (const Vector3d& v : s.vertices) farthest = std::max(farthest, n.dot(v));
  return farthest + s.radius * n.norm();
}
double reach_in_frame(const HalfSpace& s, const Vector3d& n) {
  return (n - s.normal).norm() < 1e-9 ? 0.0 : kInfinity;
}

// The point nearest to p of a shape, or of the core about which it has its radius; all in the
// shape's own frame. For a cylinder, the nearest point of its axis: exact beside it, close enough
// over an end.
Vector3d nearest_in_frame(const Box& s, const Vector3d& p) {
  return p.cwiseMax(-s.size / 2.0).cwiseMin(s.size / 2.0);
}
Vector3d nearest_on_axis(double length, const Vector3d& p) {
  return {0.0, 0.0, std::clamp(p.z(), -length / 2.0, length / 2.0)};
}
Vector3d nearest_in_frame(const Cylinder& s, const Vector3d& p) {
  return nearest_on_axis(s.length, p);
}
Vector3d nearest_in_frame(const Capsule& s, const Vector3d& p) {
  return nearest_on_axis(s.length, p);
}
Vector3d nearest_in_frame(const Sphere&, const Vector3d&) { return Vector3d::Zero(); }
template <class S>
Vector3d nearest_in_frame(const S&, const Vector3d& p) {
  return p;
}

// Without faces FCL searches all vertices for support points: correct for any order of them.
fcl::Convexd convex(const std::vector<Vector3d>& vertices) {
  return {std::make_shared<std::vector<Vector3d>>(vertices), 0,
          std::make_shared<std::vector<int>>()};
}

// FCL gets the core of a polytope; the radius is subtracted afterwards.
FclShape to_fcl(const Box& s) { return fcl::Boxd(s.size); }
FclShape to_fcl(const Cylinder& s) { return fcl::Cylinderd(s.radius, s.length); }
FclShape to_fcl(const Sphere& s) { return fcl::Sphered(s.radius); }
FclShape to_fcl(const Capsule& s) { return fcl::Capsuled(s.radius, s.length); }
FclShape to_fcl(const Ellipsoid& s) { return fcl::Ellipsoidd(s.radii); }
FclShape to_fcl(const HalfSpace&) { return std::monostate{}; }
FclShape to_fcl(const Polytope& s) { return convex(s.vertices); }

fcl::Transform3d to_fcl(const Pose& pose) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = pose.q.toRotationMatrix();
  transform.translation() = pose.p;
  return transform;
}

// A shape in the form required by FCL's GJK.
template <class S>
class GjkObject {
 public:
  using Initializer = fcl::detail::GJKInitializer<double, S>;
  GjkObject(const S& shape, const fcl::Transform3d& pose)
      : object_(Initializer::createGJKObject(shape, pose)) {}
  ~GjkObject() { Initializer::deleteGJKObject(object_); }
  GjkObject(const GjkObject&) = delete;
  GjkObject& operator=(const GjkObject&) = delete;
  [[nodiscard]] const void* get() const { return object_; }

 private:
  void* object_;
};

struct Nearest {
  Vector3d on_body = Vector3d::Zero();
  Vector3d on_other = Vector3d::Zero();
};

// Equal points if the bodies overlap. FCL's own solver class is not used, because Debian's library
// is built with assertions that end the process; its headers are built with our flags.
template <class S>
Nearest gjk(const fcl::Convexd& body, const fcl::Transform3d& X_WB, const S& other,
            const fcl::Transform3d& X_WO) {
  if constexpr (std::is_same_v<S, std::monostate>) {
    return {};
  } else {
    const GjkObject<fcl::Convexd> first(body, X_WB);
    const GjkObject<S> second(other, X_WO);
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.support1 = fcl::detail::GJKInitializer<double, fcl::Convexd>::getSupportFunction();
    ccd.support2 = fcl::detail::GJKInitializer<double, S>::getSupportFunction();
    ccd.max_iterations = 200;
    ccd.dist_tolerance = 1e-8;
    ccd_vec3_t p{};
    ccd_vec3_t q{};
    fcl::detail::libccd_extension::ccdGJKDist2(first.get(), second.get(), &ccd, &p, &q);
    return {{p.v[0], p.v[1], p.v[2]}, {q.v[0], q.v[1], q.v[2]}};
  }
}

}  // namespace

struct FixedBody::Geometry {
  FclShape shape;
  fcl::Transform3d X_WO;
};

struct MovingBody::Geometry {
  fcl::Convexd convex;
};

FixedBody::FixedBody(const Obstacle& obstacle)
    : shape_(obstacle.shape),
      X_WO_(obstacle.X_WO),
      R_OW_(obstacle.X_WO.q.toRotationMatrix().transpose()) {
  if (const auto* half_space = std::get_if<HalfSpace>(&shape_)) {
    axes_W_.push_back(X_WO_.q * half_space->normal);
  } else {
    axes_W_.reserve(6);
    for (int axis = 0; axis < 3; ++axis) {
      axes_W_.push_back(R_OW_.row(axis).transpose());
      axes_W_.push_back(-axes_W_.back());
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    box_W_.max()[axis] = reach(Vector3d::Unit(axis));
    box_W_.min()[axis] = -reach(-Vector3d::Unit(axis));
  }
}

FixedBody::FixedBody(FixedBody&&) noexcept = default;
FixedBody::~FixedBody() = default;

const FixedBody::Geometry& FixedBody::geometry() const {
  if (!geometry_) {
    geometry_.reset(new Geometry{
        std::visit([](const auto& s) -> FclShape { return to_fcl(s); }, shape_), to_fcl(X_WO_)});
  }
  return *geometry_;
}

double FixedBody::reach(const Vector3d& n_W) const {
  const Vector3d n_O = R_OW_ * n_W;
  return n_W.dot(X_WO_.p) +
         std::visit([&](const auto& s) { return reach_in_frame(s, n_O); }, shape_);
}

Vector3d FixedBody::towards(const Vector3d& p_W) const {
  const Vector3d p_O = R_OW_ * (p_W - X_WO_.p);
  const Vector3d offset_O =
      p_O - std::visit([&](const auto& s) { return nearest_in_frame(s, p_O); }, shape_);
  const double distance = offset_O.norm();
  return distance < kTouching ? Vector3d(Vector3d::Zero())
                              : Vector3d(R_OW_.transpose() * offset_O / distance);
}

MovingBody::MovingBody(const std::vector<Vector3d>& vertices_B)
    : vertices_B_(static_cast<Eigen::Index>(vertices_B.size()), 3) {
  DIVE_DEMAND(!vertices_B.empty());
  for (std::size_t i = 0; i < vertices_B.size(); ++i) {
    vertices_B_.row(static_cast<Eigen::Index>(i)) = vertices_B[i].transpose();
    radius_ = std::max(radius_, vertices_B[i].norm());
  }
  geometry_.reset(new Geometry{convex(vertices_B)});
}

MovingBody::MovingBody(MovingBody&&) noexcept = default;
MovingBody::~MovingBody() = default;

double MovingBody::least(const Pose& X_WB, const Vector3d& n_W) const {
  const Vector3d n_B = X_WB.q.conjugate() * n_W;
  const double lowest =
      (n_B.x() * vertices_B_.col(0) + n_B.y() * vertices_B_.col(1) + n_B.z() * vertices_B_.col(2))
          .minCoeff();
  return lowest + n_W.dot(X_WB.p);
}

double MovingBody::reach(const Pose& X_WB, const Vector3d& n_W) const { return -least(X_WB, -n_W); }

double MovingBody::separation(const Pose& X_WB, const FixedBody& other, const Vector3d& n_W) const {
  return least(X_WB, n_W) - other.reach(n_W);
}

// Any direction gives a bound; these give the exact depth in most walls and floors.
Separator MovingBody::along_axes(const Pose& X_WB, const FixedBody& other) const {
  Separator best{Vector3d::UnitZ(), -kInfinity, -kInfinity};
  for (const Vector3d& n_W : other.axes_W_) {
    const double along = separation(X_WB, other, n_W);
    if (along > best.separation) best = {n_W, along, along};
  }
  return best;
}

// For parallel boxes FCL may return points that are not the nearest; their distance then exceeds
// the separation along their direction. A shift of a micrometre, after which nothing is parallel,
// solves this.
Separator MovingBody::nearest(const Pose& X_WB, const FixedBody& other) const {
  if (std::holds_alternative<HalfSpace>(other.shape_)) return along_axes(X_WB, other);
  Separator best = ask(X_WB, X_WB, other);
  if (best.distance - best.separation > kMaxDiscrepancy) {
    const Vector3d push = 1e-6 * Vector3d(0.36, 0.85, 0.39);
    const Separator again = ask({X_WB.p + push, X_WB.q}, X_WB, other);
    if (again.separation > best.separation) best = again;
  }
  return best;
}

Separator MovingBody::ask(const Pose& X_WB_asked, const Pose& X_WB, const FixedBody& other) const {
  const fcl::Transform3d pose = to_fcl(X_WB_asked);
  const Nearest nearest = std::visit(
      [&](const auto& shape) { return gjk(geometry_->convex, pose, shape, other.geometry().X_WO); },
      other.geometry().shape);
  return between(X_WB, other, nearest.on_body, nearest.on_other);
}

Separator MovingBody::between(const Pose& X_WB, const FixedBody& other, const Vector3d& on_body_W,
                              const Vector3d& on_other_W) const {
  const double apart = (on_body_W - on_other_W).norm();
  const bool has_direction = apart >= kTouching && apart < kInfinity;  // NaN has none
  if (!has_direction) return along_axes(X_WB, other);
  const Vector3d n_W = (on_body_W - on_other_W) / apart;
  const auto* polytope = std::get_if<Polytope>(&other.shape_);
  return {n_W, separation(X_WB, other, n_W),
          apart - (polytope != nullptr ? polytope->radius : 0.0)};
}

}  // namespace dive::planning::certify
