#pragma once
// The obstacles near each part of a path. The path is halved recursively, and each half keeps only
// the obstacles within reach of it: O(obstacles + neighbours * log parts), without a tree over the
// obstacles. Used by the certificate alone, which must not share a search with the optimiser.

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dive::planning::certify {

class Neighbours {
 public:
  void add(const Eigen::AlignedBox3d& obstacle_W) { obstacles_.push_back(obstacle_W); }

  /// Calls `visit(part, obstacle, distance)` for each of `parts` (boxes) and each obstacle whose
  /// box is at most `reach()` metres from it, ascending in part, then in obstacle. `visit` may
  /// lower the result of `reach`; distances are between boxes, 0 where they overlap.
  template <class Reach, class Visit>
  void visit(std::span<const Eigen::AlignedBox3d> parts, const Reach& reach, const Visit& visit) {
    if (parts.empty()) return;
    nodes_.resize(2 * parts.size() - 1);
    build(0, parts);
    found_.clear();
    for (std::size_t k = 0; k < obstacles_.size(); ++k) {
      if (distance(obstacles_[k], nodes_[0]) <= reach()) found_.push_back(static_cast<int>(k));
    }
    descend(0, 0, parts.size(), 0, reach, visit);
  }

 private:
  static double distance(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
    return (a.min() - b.max()).cwiseMax(b.min() - a.max()).cwiseMax(0.0).norm();
  }

  // Node `at` is the box around `parts`; its first half is the next node, its second half follows
  // all nodes of the first.
  void build(std::size_t at, std::span<const Eigen::AlignedBox3d> parts) {
    nodes_[at] = parts.front();
    if (parts.size() == 1) return;
    const std::size_t half = parts.size() / 2;
    build(at + 1, parts.first(half));
    build(at + 2 * half, parts.subspan(half));
    nodes_[at] = nodes_[at + 1].merged(nodes_[at + 2 * half]);
  }

  // Candidates are found_[begin, ...). Those within reach of the children are appended, and removed
  // again afterwards.
  template <class Reach, class Visit>
  void descend(std::size_t at, std::size_t first, std::size_t count, std::size_t begin,
               const Reach& reach, const Visit& visit) {
    const std::size_t end = found_.size();
    for (std::size_t i = begin; i < end; ++i) {
      const int obstacle = found_[i];
      const double apart = distance(obstacles_[static_cast<std::size_t>(obstacle)], nodes_[at]);
      if (apart > reach()) continue;
      if (count == 1) {
        visit(static_cast<int>(first), obstacle, apart);
      } else {
        found_.push_back(obstacle);
      }
    }
    if (count > 1 && found_.size() > end) {
      const std::size_t half = count / 2;
      descend(at + 1, first, half, end, reach, visit);
      descend(at + 2 * half, first + half, count - half, end, reach, visit);
    }
    found_.resize(end);
  }

  std::vector<Eigen::AlignedBox3d> obstacles_;
  std::vector<Eigen::AlignedBox3d> nodes_;
  std::vector<int> found_;
};

}  // namespace dive::planning::certify
