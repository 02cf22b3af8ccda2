#pragma once
// The obstacle terms: signed distances between obstacles and the convex hull of the vehicle at two
// consecutive waypoints, and how they change when the waypoints move.

#include <span>
#include <vector>

#include "common/se3.h"
#include "planning/trajopt/banded_qp.h"
#include "planning/world/scene.h"

namespace dive::planning {

/// One obstacle near one segment.
struct SweepContact {
  int segment = 0;  ///< First waypoint of the segment from `segment` to `segment + 1`.
  int obstacle = -1;
  double distance = 0.0;  ///< Signed distance of the hull of both poses, m.
  double pad = 0.0;       ///< Largest distance by which the true sweep exceeds that hull, m.
  /// Unit normal from the obstacle to the hull.
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d point_on_obstacle_W = Eigen::Vector3d::Zero();
  /// d distance / d step of the two waypoints (dp in W, rotation vector in B; 6 each). The nearest
  /// point of the hull is a convex combination of points of both poses, and so is its motion
  /// (Schulman et al. 2014, eq. 20-22).
  Vector12d gradient;
};

/// Finds the contacts of a path. Keeps a reference to the scene.
class SweepContacts {
 public:
  SweepContacts(Scene& scene, std::vector<Eigen::Vector3d> hull_vertices_B);

  /// All contacts with distance - pad below `cutoff`, by segment, then obstacle. `out` is cleared
  /// first.
  void find(std::span<const Pose> path, double cutoff, std::vector<SweepContact>& out);

  /// Adds to `contacts`, found for `path`, the other corners of the hull that face the same
  /// obstacle within `cutoff` of its nearest plane. A side along a wall has two ends: turning moves
  /// one away and the other nearer, which no single point shows.
  void add_corners(std::span<const Pose> path, double cutoff, std::vector<SweepContact>& contacts);

  /// Largest distance by which the sweep between two poses exceeds their hull when the vehicle
  /// turns by `angle` (rad): a point at radius r deviates from its chord by at most r (1 -
  /// cos(angle / 2)).
  [[nodiscard]] double pad(double angle) const;

 private:
  void add_corners_of(const Pose& pose, int side, double cutoff, const SweepContact& contact,
                      std::vector<SweepContact>& contacts);
  [[nodiscard]] Vector12d gradient_of(const Contact& contact, const Pose& a, const Pose& b) const;

  Scene& scene_;
  std::vector<Eigen::Vector3d> vertices_B_;
  double radius_ = 0.0;
  std::vector<Eigen::Vector3d> sweep_W_;
  std::vector<Contact> found_;
  std::vector<Eigen::Vector3d> corners_;
};

}  // namespace dive::planning
