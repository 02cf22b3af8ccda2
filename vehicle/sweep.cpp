#include "vehicle/sweep.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/assert.h"
#include "vehicle/convex_hull.h"

namespace dive::vehicle {
namespace {

using std::numbers::pi;

constexpr int kCylinderSides = 16;
constexpr double kChordError = 0.003;         // m
constexpr double kRelativeChordError = 0.01;  // fraction of the radius
constexpr std::size_t kMaxVertices = 256;

Points box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Points corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                         (i & 4) != 0 ? high.z() : low.z());
  }
  return corners;
}

Points cylinder(double radius, double length) {
  Points points;
  const double outside = radius / std::cos(pi / kCylinderSides);
  for (int i = 0; i < kCylinderSides; ++i) {
    const double angle = 2.0 * pi * i / kCylinderSides;
    for (const double z : {-0.5 * length, 0.5 * length}) {
      points.emplace_back(outside * std::cos(angle), outside * std::sin(angle), z);
    }
  }
  return points;
}

// An icosahedron's corners and its edges' midpoints on the unit sphere, scaled until the faces of
// their hull touch the sphere. Of the two kinds of faces, those in the middle of an icosahedron's
// face are nearer to the centre.
Points sphere(double radius) {
  constexpr double kGolden = std::numbers::phi;
  Points corners;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-kGolden, kGolden}) {
      corners.emplace_back(0.0, a, b);
      corners.emplace_back(a, b, 0.0);
      corners.emplace_back(b, 0.0, a);
    }
  }
  for (Eigen::Vector3d& corner : corners) corner.normalize();
  // Neighbours on the unit sphere are the pairs with the largest product, 1 / sqrt(5).
  const auto adjacent = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::abs(a.dot(b) - 1.0 / std::sqrt(5.0)) < 1e-9;
  };
  Points points = corners;
  double inner = 1.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = i + 1; j < corners.size(); ++j) {
      if (!adjacent(corners[i], corners[j])) continue;
      points.push_back((corners[i] + corners[j]).normalized());
      for (std::size_t k = j + 1; k < corners.size(); ++k) {
        if (!adjacent(corners[i], corners[k]) || !adjacent(corners[j], corners[k])) continue;
        const Eigen::Vector3d face = (corners[i] + corners[j] + corners[k]).normalized();
        inner = std::min(inner, face.dot((corners[i] + corners[j]).normalized()));
      }
    }
  }
  for (Eigen::Vector3d& point : points) point *= radius / inner;
  return points;
}

Points simplified(Points points) {
  points = convex_hull(points).vertices;
  if (points.size() <= kMaxVertices) return points;
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3d& point : points) bounds.extend(point);
  return box(bounds.min(), bounds.max());
}

Points slid(const Points& solid, const Eigen::Vector3d& axis, double lower, double upper) {
  Points points;
  for (const Eigen::Vector3d& point : solid) {
    points.push_back(point + lower * axis);
    points.push_back(point + upper * axis);
  }
  return points;
}

// A point at radius r covers an arc. The polygon of the arc's tangents at equal steps contains it:
// its corners are in the middle of each step at r / cos(step / 2), its ends are the arc's own.
Points turned(const Points& solid, const Eigen::Vector3d& axis, double lower, double upper) {
  const bool full_circle = upper - lower >= 2.0 * pi;
  if (full_circle) upper = lower + 2.0 * pi;
  double radius = 0.0;
  for (const Eigen::Vector3d& point : solid) {
    radius = std::max(radius, point.cross(axis).norm());
  }
  const double allowed = std::max(kChordError, kRelativeChordError * radius);
  const double widest = 2.0 * std::acos(radius / (radius + allowed));
  const int steps = std::max(1, static_cast<int>(std::ceil((upper - lower) / widest)));
  const double step = (upper - lower) / steps;

  Points points;
  const auto add_turned = [&](double angle, double growth) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    for (const Eigen::Vector3d& point : solid) {
      const Eigen::Vector3d along = axis * axis.dot(point);
      points.push_back(along + growth * (R * (point - along)));
    }
  };
  if (!full_circle) {
    add_turned(lower, 1.0);
    add_turned(upper, 1.0);
  }
  for (int i = 0; i < steps; ++i) {
    add_turned(lower + (i + 0.5) * step, 1.0 / std::cos(0.5 * step));
  }
  return points;
}

}  // namespace

Points circumscribed(const urdf::Geometry& geometry) {
  if (const auto* shape = dynamic_cast<const urdf::Box*>(&geometry)) {
    const Eigen::Vector3d half = 0.5 * Eigen::Vector3d(shape->dim.x, shape->dim.y, shape->dim.z);
    return box(-half, half);
  }
  if (const auto* shape = dynamic_cast<const urdf::Cylinder*>(&geometry)) {
    return cylinder(shape->radius, shape->length);
  }
  const auto* shape = dynamic_cast<const urdf::Sphere*>(&geometry);
  DIVE_DEMAND(shape != nullptr);
  return sphere(shape->radius);
}

Points swept(const urdf::Joint& joint, const Points& solid) {
  const Eigen::Vector3d axis(joint.axis.x, joint.axis.y, joint.axis.z);
  Points points = solid;
  if (joint.type == urdf::Joint::REVOLUTE) {
    points = simplified(turned(solid, axis, joint.limits->lower, joint.limits->upper));
  } else if (joint.type == urdf::Joint::CONTINUOUS) {
    points = simplified(turned(solid, axis, -pi, pi));
  } else if (joint.type == urdf::Joint::PRISMATIC) {
    points = simplified(slid(solid, axis, joint.limits->lower, joint.limits->upper));
  }
  const Pose X_PJ = to_pose(joint.parent_to_joint_origin_transform);
  for (Eigen::Vector3d& point : points) point = X_PJ * point;
  return points;
}

Pose to_pose(const urdf::Pose& pose) {
  return {Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z),
          Eigen::Quaterniond(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z)};
}

}  // namespace dive::vehicle
