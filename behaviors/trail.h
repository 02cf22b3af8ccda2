#pragma once
// The breadcrumb trail: where the vehicle has been, so that it can go back the way it came. Under
// an overhead the way out is back along it to the last point with open water above.

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "common/se3.h"

namespace dive::behaviors {

/// Of D_min: so near to the trail all is as free as on it, so that it may be left out what lies
/// between two places of it that are no further apart.
inline constexpr double kTrailLinkShare = 0.8;

/// Level poses at two or more points, each heading for the next.
[[nodiscard]] std::vector<Pose> level_poses(const std::vector<Eigen::Vector3d>& points);

class Trail {
 public:
  /// Drops a crumb every `spacing` m. Bounded: when `capacity` crumbs are there every second one
  /// goes and the spacing doubles.
  explicit Trail(double spacing = 0.5, std::size_t capacity = 4096);

  /// `open_above`: nothing solid between here and the surface.
  void add(const Eigen::Vector3d& p_W, bool open_above);

  struct Crumb {
    Eigen::Vector3d p_W;
    bool open_above;
  };

  struct Way {
    std::vector<Eigen::Vector3d> points;
    bool arrives = false;
    double length_m = 0.0;
  };
  /// The shortest way from `p_W` along the trail to a crumb with open water above it, both
  /// included, and up to `beyond_m` of open water on; nothing but `p_W` when there is none (then it
  /// does not arrive). Where the trail comes within `link_m` of itself it may be left out what lies
  /// between: a vehicle that is on its way out must not go in again to follow the way it came.
  [[nodiscard]] Way way_out(const Eigen::Vector3d& p_W, double link_m, double beyond_m = 0.0) const;

  /// As way_out, to the first crumb for which `is_there` holds, asked from the nearest on, none
  /// farther along the trail than `most_m`.
  [[nodiscard]] Way way_to(const Eigen::Vector3d& p_W, double link_m, double most_m,
                           const std::function<bool(const Crumb&)>& is_there) const;

  /// Length of the trail from the newest crumb with open water above to the newest one of all, m;
  /// 0 while that is the same, and from the first crumb where there is none with open water.
  [[nodiscard]] double penetration_m() const { return penetration_m_; }

  /// Was there open water above the crumb that is nearest to `p_W`, or above one that is hardly
  /// farther? There is at least one.
  [[nodiscard]] bool was_open_at(const Eigen::Vector3d& p_W) const;

  /// How many crumbs have ever been dropped, and the newest of them (there is one).
  [[nodiscard]] std::size_t dropped() const { return dropped_; }
  [[nodiscard]] const Crumb& newest() const { return crumbs_.back(); }

  [[nodiscard]] std::size_t size() const { return crumbs_.size(); }

 private:
  /// The way to a crumb, and which; crumbs_.size(): it does not arrive.
  struct Found {
    Way way;
    std::size_t end = 0;
  };
  void thin_out();
  [[nodiscard]] Found find(const Eigen::Vector3d& p_W, double link_m, double most_m,
                           const std::function<bool(const Crumb&)>& is_there) const;
  [[nodiscard]] Way further(Way way, std::size_t end, double beyond_m) const;
  [[nodiscard]] Way traced(const std::vector<std::size_t>& before, std::size_t end, double length,
                           const Eigen::Vector3d& p_W) const;

  double spacing_;
  double penetration_m_ = 0.0;
  std::size_t dropped_ = 0;
  std::size_t capacity_;
  std::vector<Crumb> crumbs_;
};

}  // namespace dive::behaviors
