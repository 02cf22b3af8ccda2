#pragma once
// The broadphase: a tree of boxes, built once over static obstacles.

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dive::planning {

/// Splits the boxes at the median along their longest spread until a few are left; every node
/// stores the box around its subtree. Visits skip whole branches by their box.
/// bench/world_bench.cpp compares it with FCL's tree.
class BoxTree {
 public:
  explicit BoxTree(const std::vector<Eigen::AlignedBox3d>& boxes);

  /// Calls `visit(index)` for boxes no farther from `query` (a box or a point) than the reach, in a
  /// fixed order, nearer branches first. `visit` returns the new reach, m: a search for the nearest
  /// lowers it, a search for all keeps it, and a negative value ends the search.
  template <class Query, class Visit>
  void visit(const Query& query, double reach, Visit&& visit) const {
    if (!nodes_.empty()) descend(0, query, reach, visit);
  }

 private:
  static constexpr std::uint32_t kLeafSize = 4;

  // A leaf has items [first, first + count); an inner node has count 0, its left child next to it
  // and its right child at `first`.
  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };
  struct Item {
    Eigen::AlignedBox3d box;
    std::uint32_t index = 0;
  };

  void build(std::uint32_t first, std::uint32_t count);

  static double squared_distance(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& point) {
    return (box.min() - point).cwiseMax(point - box.max()).cwiseMax(0.0).squaredNorm();
  }
  static double squared_distance(const Eigen::AlignedBox3d& box, const Eigen::AlignedBox3d& other) {
    return (box.min() - other.max()).cwiseMax(other.min() - box.max()).cwiseMax(0.0).squaredNorm();
  }

  template <class Query, class Visit>
  void descend(std::uint32_t at, const Query& query, double& reach, Visit& visit) const;

  std::vector<Node> nodes_;
  std::vector<Item> items_;
};

template <class Query, class Visit>
void BoxTree::descend(std::uint32_t at, const Query& query, double& reach, Visit& visit) const {
  const Node& node = nodes_[at];
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
    if (squared_distance(items_[i].box, query) <= reach * std::abs(reach))
      reach = visit(items_[i].index);
  }
  if (node.count > 0) return;
  std::uint32_t near = at + 1;
  std::uint32_t far = node.first;
  double to_near = squared_distance(nodes_[near].box, query);
  double to_far = squared_distance(nodes_[far].box, query);
  if (to_far < to_near) {
    std::swap(near, far);
    std::swap(to_near, to_far);
  }
  if (to_near <= reach * std::abs(reach)) descend(near, query, reach, visit);
  if (to_far <= reach * std::abs(reach)) descend(far, query, reach, visit);
}

}  // namespace dive::planning
