#include "planning/world/box_tree.h"

#include <algorithm>
#include <cmath>

namespace dive::planning {

BoxTree::BoxTree(const std::vector<Eigen::AlignedBox3d>& boxes) {
  items_.reserve(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    items_.push_back({boxes[i], static_cast<std::uint32_t>(i)});
  }
  if (!items_.empty()) build(0, static_cast<std::uint32_t>(items_.size()));
}

void BoxTree::build(std::uint32_t first, std::uint32_t count) {
  const std::size_t at = nodes_.size();
  nodes_.push_back({{}, first, count});
  // Twice the centre; infinite boxes (half-spaces) count as centred on 0.
  const auto middle = [&](const Item& item, Eigen::Index axis) {
    const double twice = item.box.min()[axis] + item.box.max()[axis];
    return std::isfinite(twice) ? twice : 0.0;
  };
  Eigen::AlignedBox3d middles;
  for (std::uint32_t i = first; i < first + count; ++i) {
    nodes_[at].box.extend(items_[i].box);
    middles.extend(
        Eigen::Vector3d(middle(items_[i], 0), middle(items_[i], 1), middle(items_[i], 2)));
  }
  if (count <= kLeafSize) return;

  Eigen::Index axis = 0;
  middles.sizes().maxCoeff(&axis);
  const std::uint32_t half = count / 2;
  // Ties by index, so that the order is the same with every standard library.
  std::nth_element(items_.begin() + first, items_.begin() + first + half,
                   items_.begin() + first + count, [&](const Item& a, const Item& b) {
                     const double difference = middle(a, axis) - middle(b, axis);
                     return difference < 0.0 || (difference == 0.0 && a.index < b.index);
                   });
  build(first, half);
  nodes_[at].first = static_cast<std::uint32_t>(nodes_.size());
  nodes_[at].count = 0;
  build(first + half, count - half);
}

}  // namespace dive::planning
