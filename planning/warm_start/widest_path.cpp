#include "planning/warm_start/widest_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kMinStep = 0.02;  // m: thinner walls may be missed

class Grid {
 public:
  Grid(const Scene& scene, const WidestPathQuery& query) : scene_(scene), query_(query) {
    const Vector3d size = query.region.sizes().cwiseMax(query.finest_cell);
    cell_ = std::max(query.finest_cell, std::cbrt(size.prod() / query.max_cells));
    // A flat region has few layers, so the cube root may give more cells than allowed.
    while (shape_for(size).cast<double>().prod() > query.max_cells) cell_ *= 1.1;
    shape_ = shape_for(size);
    const auto cells = static_cast<std::size_t>(shape_.prod());
    distance_.assign(cells, kUnknown);
    clearance_.assign(cells, -1.0);
    length_.assign(cells, 0.0);
    parent_.assign(cells, -1);
    settled_.assign(cells, false);
  }

  std::optional<WidestPath> search() {
    const int start = nearest_cell(query_.start_W);
    const int goal = nearest_cell(query_.goal_W);
    // Start and goal are given: their cells count as having the largest clearance.
    distance_[at(start)] = distance_[at(goal)] = query_.enough;
    clearance_[at(start)] = query_.enough;
    queue_.push({query_.enough, 0.0, start});
    while (!queue_.empty()) {
      const Entry entry = queue_.top();
      queue_.pop();
      if (settled_[at(entry.cell)]) continue;
      settled_[at(entry.cell)] = true;
      if (entry.cell == goal) return path_to(goal);
      relax_neighbours(entry.cell);
    }
    return std::nullopt;
  }

 private:
  struct Entry {
    double clearance;
    double length;
    int cell;
    // Largest clearance first, then shortest; then by number, so that the order is deterministic.
    bool operator<(const Entry& other) const {
      if (clearance != other.clearance) return clearance < other.clearance;
      if (length != other.length) return length > other.length;
      return cell > other.cell;
    }
  };

  [[nodiscard]] static std::size_t at(int cell) { return static_cast<std::size_t>(cell); }
  [[nodiscard]] Vector3i shape_for(const Vector3d& size) const {
    return (size / cell_).array().ceil().cast<int>().max(1);
  }
  [[nodiscard]] int index(const Vector3i& c) const {
    return (c.z() * shape_.y() + c.y()) * shape_.x() + c.x();
  }
  [[nodiscard]] Vector3i coordinates(int cell) const {
    return {cell % shape_.x(), cell / shape_.x() % shape_.y(), cell / (shape_.x() * shape_.y())};
  }
  [[nodiscard]] Vector3d centre(int cell) const {
    return query_.region.min() + cell_ * (coordinates(cell).cast<double>().array() + 0.5).matrix();
  }
  [[nodiscard]] int nearest_cell(const Vector3d& p) const {
    const Vector3i c = ((p - query_.region.min()) / cell_).array().floor().cast<int>();
    return index(c.cwiseMax(0).cwiseMin(shape_ - Vector3i::Ones()));
  }

  [[nodiscard]] double distance(int cell) {
    double& known = distance_[at(cell)];
    if (std::isnan(known)) known = std::min(scene_.point_distance(centre(cell)), query_.enough);
    return known;
  }

  // Clearance between two points with known clearance. Where their balls overlap there is no
  // obstacle.
  [[nodiscard]] double clearance_between(const Vector3d& a, double clearance_a, const Vector3d& b,
                                         double clearance_b) const {
    const double length = (b - a).norm();
    if (clearance_a <= 0.0 || clearance_b <= 0.0 || clearance_a + clearance_b >= length ||
        length < kMinStep) {
      return std::min(clearance_a, clearance_b);
    }
    const Vector3d middle = 0.5 * (a + b);
    const double clearance = scene_.point_distance(middle);
    if (clearance <= 0.0) return clearance;
    return std::min(clearance_between(a, clearance_a, middle, clearance),
                    clearance_between(middle, clearance, b, clearance_b));
  }

  void relax_neighbours(int cell) {
    const Vector3i c = coordinates(cell);
    for (int neighbour = 0; neighbour < 27; ++neighbour) {
      const Vector3i step(neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1);
      const Vector3i n = c + step;
      if ((n.array() < 0).any() || (n.array() >= shape_.array()).any()) continue;
      if (const int to = index(n); !settled_[at(to)]) relax(cell, to);
    }
  }

  void relax(int from, int to) {
    const double own = std::min(clearance_[at(from)], distance(to));
    if (own <= 0.0 || own < clearance_[at(to)]) return;
    const double clearance =
        std::min(own, clearance_between(centre(from), distance(from), centre(to), distance(to)));
    if (clearance <= 0.0) return;
    const double length = length_[at(from)] + (centre(to) - centre(from)).norm();
    if (clearance < clearance_[at(to)] ||
        (clearance == clearance_[at(to)] && length >= length_[at(to)]))
      return;
    clearance_[at(to)] = clearance;
    length_[at(to)] = length;
    parent_[at(to)] = from;
    queue_.push({clearance, length, to});
  }

  [[nodiscard]] WidestPath path_to(int goal) const {
    WidestPath result;
    result.radius = clearance_[at(goal)];
    // Any path runs within half a cell's diagonal of a chain of centres, whose clearance differs by
    // no more than that.
    result.bound = result.radius + 0.5 * std::sqrt(3.0) * cell_;
    for (int cell = goal; cell >= 0; cell = parent_[at(cell)]) {
      result.positions.push_back(centre(cell));
    }
    result.positions.front() = query_.goal_W;
    if (result.positions.size() == 1) result.positions.push_back(query_.start_W);
    result.positions.back() = query_.start_W;
    std::reverse(result.positions.begin(), result.positions.end());
    return result;
  }

  const Scene& scene_;
  const WidestPathQuery& query_;
  double cell_ = 0.0;
  Vector3i shape_ = Vector3i::Zero();
  std::vector<double> distance_;
  std::vector<double> clearance_;
  std::vector<double> length_;
  std::vector<int> parent_;
  std::vector<bool> settled_;
  std::priority_queue<Entry> queue_;
};

}  // namespace

std::optional<WidestPath> widest_path(const Scene& scene, const WidestPathQuery& query) {
  return Grid(scene, query).search();
}

}  // namespace dive::planning
