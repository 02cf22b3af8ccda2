#include "planning/trajopt/sweep_contacts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"

namespace dive::planning {
namespace {

constexpr double kLevel = 1e-3;  // m: vertices within this height share the contact
constexpr double kApart = 0.3;   // m: nearer corners count as one
// m: tolerance of a corner's distance to the obstacles above its distance to the plane
constexpr double kBeside = 0.05;

/// The part of one pose that faces an obstacle.
struct Support {
  double height = 0.0;                                ///< Least n . x over the vertices, m.
  Eigen::Vector3d point_B = Eigen::Vector3d::Zero();  ///< Mean of the vertices at that height.
};

Support support(std::span<const Eigen::Vector3d> vertices_B, const Pose& pose,
                const Eigen::Vector3d& n_W) {
  const Eigen::Vector3d n_B = pose.q.conjugate() * n_W;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& vertex : vertices_B) least = std::min(least, n_B.dot(vertex));
  Support result;
  int count = 0;
  for (const Eigen::Vector3d& vertex : vertices_B) {
    if (n_B.dot(vertex) > least + kLevel) continue;
    result.point_B += vertex;
    ++count;
  }
  result.point_B /= count;
  result.height = least + n_W.dot(pose.p);
  return result;
}

// The first pose's share of the contact: one if that pose is the nearer one, otherwise the position
// of the nearest point between the two supports.
double share_of_first(const Support& a, const Support& b, const Eigen::Vector3d& a_W,
                      const Eigen::Vector3d& b_W, const Eigen::Vector3d& point_W) {
  if (a.height < b.height - kLevel) return 1.0;
  if (b.height < a.height - kLevel) return 0.0;
  const Eigen::Vector3d motion = b_W - a_W;
  if (motion.squaredNorm() < 1e-18) return 0.5;
  return std::clamp((b_W - point_W).dot(motion) / motion.squaredNorm(), 0.0, 1.0);
}

}  // namespace

SweepContacts::SweepContacts(Scene& scene, std::vector<Eigen::Vector3d> hull_vertices_B)
    : scene_(scene), vertices_B_(std::move(hull_vertices_B)) {
  DIVE_DEMAND(!vertices_B_.empty());
  for (const Eigen::Vector3d& vertex : vertices_B_) radius_ = std::max(radius_, vertex.norm());
  sweep_W_.resize(2 * vertices_B_.size());
}

double SweepContacts::pad(double angle) const { return radius_ * (1.0 - std::cos(0.5 * angle)); }

Vector12d SweepContacts::gradient_of(const Contact& contact, const Pose& a, const Pose& b) const {
  const Eigen::Vector3d& n_W = contact.normal_W;
  const Support at_a = support(vertices_B_, a, n_W);
  const Support at_b = support(vertices_B_, b, n_W);
  const double share =
      share_of_first(at_a, at_b, a * at_a.point_B, b * at_b.point_B, contact.point_on_solid_W);
  // A point v of the body moves by dp + R (theta x v), so n . that = n . dp + (v x R'n) . theta.
  Vector12d gradient;
  gradient << share * n_W, share * at_a.point_B.cross(a.q.conjugate() * n_W), (1.0 - share) * n_W,
      (1.0 - share) * at_b.point_B.cross(b.q.conjugate() * n_W);
  return gradient;
}

void SweepContacts::find(std::span<const Pose> path, double cutoff,
                         std::vector<SweepContact>& out) {
  out.clear();
  const std::size_t count = vertices_B_.size();
  // Each pose's vertices are in two sweeps: they stay in their half of the array, and the next
  // pose's overwrite the other.
  const auto place = [&](std::size_t i) {
    const Eigen::Matrix3d R_WB = path[i].q.toRotationMatrix();
    const std::size_t half = i % 2 * count;
    for (std::size_t k = 0; k < count; ++k) {
      sweep_W_[half + k] = R_WB * vertices_B_[k] + path[i].p;
    }
  };
  if (!path.empty()) place(0);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Pose& a = path[i];
    const Pose& b = path[i + 1];
    place(i + 1);
    const double missed = pad(angle_between(a.q, b.q));
    scene_.contacts(sweep_W_, cutoff + missed, found_);
    for (const Contact& contact : found_) {
      out.push_back({static_cast<int>(i), contact.obstacle, contact.distance, missed,
                     contact.normal_W, contact.point_on_obstacle_W, gradient_of(contact, a, b)});
    }
  }
}

void SweepContacts::add_corners(std::span<const Pose> path, double cutoff,
                                std::vector<SweepContact>& contacts) {
  const std::size_t found = contacts.size();
  for (std::size_t i = 0; i < found; ++i) {
    const SweepContact contact = contacts[i];
    const auto first = static_cast<std::size_t>(contact.segment);
    for (const int side : {0, 1}) {
      add_corners_of(path[first + static_cast<std::size_t>(side)], side, cutoff, contact, contacts);
    }
  }
}

void SweepContacts::add_corners_of(const Pose& pose, int side, double cutoff,
                                   const SweepContact& contact,
                                   std::vector<SweepContact>& contacts) {
  const Eigen::Vector3d n_B = pose.q.conjugate() * contact.normal_W;
  const double base = contact.normal_W.dot(pose.p - contact.point_on_obstacle_W);
  corners_.clear();
  for (const Eigen::Vector3d& vertex : vertices_B_) {
    const double distance = base + n_B.dot(vertex);
    if (distance - contact.pad >= cutoff) continue;
    const auto is_near = [&](const Eigen::Vector3d& other) {
      return (other - vertex).norm() < kApart;
    };
    if (std::ranges::any_of(corners_, is_near)) continue;
    // Beside the obstacle its plane has no meaning.
    if (scene_.point_distance(pose * vertex) > distance + kBeside) continue;
    corners_.push_back(vertex);
    SweepContact corner = contact;
    corner.distance = distance;
    corner.gradient.setZero();
    const Eigen::Index first = Eigen::Index{6} * side;
    corner.gradient.segment<3>(first) = contact.normal_W;
    corner.gradient.segment<3>(first + 3) = vertex.cross(n_B);
    contacts.push_back(corner);
  }
}

}  // namespace dive::planning
