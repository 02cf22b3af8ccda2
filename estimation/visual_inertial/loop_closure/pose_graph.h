#pragma once
// Poses of the keyframes, given the filter's motion between them and the loop closures: least
// squares over position and heading (four degrees of freedom each: gravity gives roll and pitch).
// Derivation: doc/visual-inertial/loop-closure.md.
//
// A node has the filter's pose X_WB^f = (R^f, p^f) and the unknowns (p, c): its pose is (Rz(c) R^f,
// p). An edge from i to j gives the pose of j relative to i, in the filter's frame at i:
//
//   r = [ Rz(c_i)^T (p_j - p_i) - d ;  wrap(c_j - c_i - turn) ],   r ~ N(0, covariance)
//
// For the filter's own motion from i to j: d = p_j^f - p_i^f and turn = 0.

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/se3.h"

namespace dive::estimation {

using Vector4d = Eigen::Matrix<double, 4, 1>;
using Matrix48d = Eigen::Matrix<double, 4, 8>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

/// Position (W, m) and heading (rad) of an estimate's covariance (position in W, attitude in B).
[[nodiscard]] Eigen::Matrix4d position_and_heading(const Matrix6d& covariance,
                                                   const Eigen::Quaterniond& q_WB);

/// Propagation of an error over a displacement `d` (m, in W): [I, e_z x d; 0, 1].
[[nodiscard]] Eigen::Matrix4d carried(const Eigen::Vector3d& d);

struct GraphNode {
  Utime utime = 0;
  Pose filter;                                           ///< X_WB^f
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< By the filter, of position, heading.
  Eigen::Vector3d p = Eigen::Vector3d::Zero();           ///< Position in W, m.
  double turn = 0.0;                                     ///< c, rad.

  [[nodiscard]] Pose X_WB() const;
  /// The correction of the filter's pose: X_WB = correction * X_WB^f, about the vertical.
  [[nodiscard]] Pose correction() const;
};

struct GraphEdge {
  std::size_t from = 0;
  std::size_t to = 0;
  Eigen::Vector3d d = Eigen::Vector3d::Zero();  ///< m, in the filter's frame at `from`.
  double turn = 0.0;                            ///< rad
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
};

/// Residual and Jacobian of an edge between two nodes; by [p_i, c_i, p_j, c_j].
[[nodiscard]] Vector4d edge_residual(const GraphNode& from, const GraphNode& to,
                                     const GraphEdge& edge);
[[nodiscard]] Matrix48d edge_jacobian(const GraphNode& from, const GraphNode& to);

class PoseGraph {
 public:
  /// With measured depth the filter's height has its own sigma everywhere, independent of the path
  /// between.
  explicit PoseGraph(bool has_depth) : has_depth_(has_depth) {}

  /// Adds a node, later than the last, with the filter's covariance at that time. The motion since
  /// the last node has the growth of that covariance.
  void add(Utime utime, const Pose& filter, const Eigen::Matrix4d& covariance);
  void add_loop(const GraphEdge& loop) { loops_.push_back(loop); }

  /// Optimises by Gauss-Newton. Then drops loops whose residual exceeds `gate` (chi^2 of 4), the
  /// worst first, with re-optimisation after each. False, with all nodes unchanged, if it did not
  /// converge; loops stay.
  bool optimise(double gate);

  /// Removes a node that is neither the first nor the last, and its loops; the motion edges to it
  /// and from it become one.
  void remove(std::size_t node);

  /// Covariance of (p_i, c_i, p_j, c_j) given all edges. Empty if it cannot be computed.
  [[nodiscard]] std::optional<Matrix8d> joint_covariance(std::size_t i, std::size_t j) const;

  [[nodiscard]] const std::vector<GraphNode>& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<GraphEdge>& loops() const { return loops_; }

 private:
  struct System;
  [[nodiscard]] System linearise() const;
  void add_edge(const GraphEdge& edge, System& system) const;
  void add_anchors(System& system) const;
  bool iterate();
  [[nodiscard]] bool drop_worst(double gate);

  bool has_depth_;
  std::vector<GraphNode> nodes_;
  std::vector<GraphEdge>
      odometry_edges_;  ///< Motion edges; odometry_edges_[i] goes from node i to node i + 1.
  std::vector<GraphEdge> loops_;
};

}  // namespace dive::estimation
