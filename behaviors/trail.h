#pragma once
// The breadcrumb trail: where the vehicle has been, so that it can go back the way it came. Under
// an overhead the way out is back along it to the last point with open water above.

#include <vector>

#include <Eigen/Core>

namespace dive::behaviors {

class Trail {
 public:
  /// Drops a crumb every `spacing` m. Bounded: when `capacity` crumbs are there every second one
  /// goes and the spacing doubles.
  explicit Trail(double spacing = 0.5, std::size_t capacity = 4096);

  /// `open_above`: nothing solid between here and the surface.
  void add(const Eigen::Vector3d& p_W, bool open_above);

  /// The shortest way from `p_W` along the trail to a crumb with open water above it, both
  /// included; nothing but `p_W` when there is none (then `reaches_open_water` is false). Where the
  /// trail comes within `link_m` of itself it may be left out what lies between: a vehicle that is
  /// on its way out must not go in again to follow the way it came.
  struct WayOut {
    std::vector<Eigen::Vector3d> points;
    bool reaches_open_water = false;
    double length_m = 0.0;
  };
  [[nodiscard]] WayOut way_out(const Eigen::Vector3d& p_W, double link_m,
                               double beyond_m = 0.0) const;

  /// Length of the trail from the newest crumb with open water above to the newest one of all, m;
  /// 0 while that is the same, and from the first crumb where there is none with open water.
  [[nodiscard]] double penetration_m() const { return penetration_m_; }

  /// Was there open water above the crumb that is nearest to `p_W`, or above one that is hardly
  /// farther? There is at least one.
  [[nodiscard]] bool was_open_at(const Eigen::Vector3d& p_W) const;

  struct Crumb {
    Eigen::Vector3d p_W;
    bool open_above;
  };
  /// How many crumbs have ever been dropped, and the newest of them (there is one).
  [[nodiscard]] std::size_t dropped() const { return dropped_; }
  [[nodiscard]] const Crumb& newest() const { return crumbs_.back(); }

  [[nodiscard]] std::size_t size() const { return crumbs_.size(); }

 private:
  void thin_out();
  [[nodiscard]] WayOut further(WayOut way, std::size_t end, double beyond_m) const;
  [[nodiscard]] WayOut traced(const std::vector<std::size_t>& before, std::size_t end,
                              double length, const Eigen::Vector3d& p_W) const;

  double spacing_;
  double penetration_m_ = 0.0;
  std::size_t dropped_ = 0;
  std::size_t capacity_;
  std::vector<Crumb> crumbs_;
};

}  // namespace dive::behaviors
