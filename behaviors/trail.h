#pragma once
// The breadcrumb trail: the positions of the vehicle so far, along which it can return. Under an
// overhead the exit path leads back along it to the last point with open water above.

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/map_correction.h"
#include "common/se3.h"

namespace dive::behaviors {

/// Share of D_min. Within that distance of the trail the water is as free as on it, so that the
/// part between two points of it that are no farther apart may be skipped.
inline constexpr double kTrailLinkShare = 0.8;

/// Level poses at two or more points, each heading for the next.
[[nodiscard]] std::vector<Pose> level_poses(const std::vector<Eigen::Vector3d>& points);

class Trail;

/// Level poses along the trail from `p_W` to `goal_W`; empty if the trail does not pass near the
/// goal, or is a long way round. `link_m`: see Trail::exit_path.
[[nodiscard]] std::vector<Pose> trail_to(const Trail& trail, const Eigen::Vector3d& p_W,
                                         const Eigen::Vector3d& goal_W, double link_m);

inline constexpr double kTrailSpacing = 0.5;         ///< Between breadcrumbs at first, m.
inline constexpr std::size_t kTrailCapacity = 4096;  ///< Breadcrumbs.

class Trail {
 public:
  /// Adds a breadcrumb every `spacing` m. Bounded: at `capacity` breadcrumbs every second one is
  /// removed and the spacing doubles.
  explicit Trail(double spacing = kTrailSpacing, std::size_t capacity = kTrailCapacity);

  /// `open_above`: nothing solid between p_W and the surface. `now`: see Breadcrumb::utime.
  void add(const Eigen::Vector3d& p_W, bool open_above, Utime now = 0);
  /// After a loop closure: each breadcrumb moves with what was observed at its time.
  void move(const MapCorrection& correction);
  /// Number of calls of move().
  [[nodiscard]] std::size_t moves() const { return moves_; }

  struct Breadcrumb {
    Eigen::Vector3d p_W;
    bool open_above;
    Utime utime = 0;  ///< 0: added before a restart of the executive.
  };

  struct Path {
    std::vector<Eigen::Vector3d> points;
    bool arrives = false;
    double length_m = 0.0;
  };
  /// The shortest path from `p_W` along the trail to a breadcrumb with open water above it, both
  /// included, and up to `beyond_m` farther in open water; only `p_W` if there is none (`arrives`
  /// is false then). Where the trail comes within `link_m` of itself the part between is skipped: a
  /// vehicle on its exit path must not go in again because it came that way.
  [[nodiscard]] Path exit_path(const Eigen::Vector3d& p_W, double link_m,
                               double beyond_m = 0.0) const;

  /// The same to the nearest breadcrumb along the trail for which `is_there` is true, at most
  /// `most_m` away.
  [[nodiscard]] Path path_to(const Eigen::Vector3d& p_W, double link_m, double most_m,
                             const std::function<bool(const Breadcrumb&)>& is_there) const;

  /// Length of the trail from the newest breadcrumb with open water above to the newest of all, m;
  /// 0 if they are the same. From the first breadcrumb if none has open water above.
  [[nodiscard]] double penetration_m() const { return penetration_m_; }

  /// True if the breadcrumb nearest to `p_W`, or one hardly farther away, has open water above.
  /// Requires a breadcrumb.
  [[nodiscard]] bool was_open_at(const Eigen::Vector3d& p_W) const;

  /// Number of breadcrumbs added so far, and the newest of them (requires one).
  [[nodiscard]] std::size_t dropped() const { return dropped_; }
  [[nodiscard]] const Breadcrumb& newest() const { return breadcrumbs_.back(); }

  [[nodiscard]] std::size_t size() const { return breadcrumbs_.size(); }
  [[nodiscard]] const std::vector<Breadcrumb>& breadcrumbs() const { return breadcrumbs_; }
  /// Distance between breadcrumbs at present, m.
  [[nodiscard]] double spacing() const { return spacing_; }
  /// Continues another trail of the same capacity from its breadcrumbs and spacing.
  void restore(std::span<const Breadcrumb> breadcrumbs, double spacing);

 private:
  /// The path to a breadcrumb and its index; crumbs_.size(): no such breadcrumb.
  struct Found {
    Path path;
    std::size_t end = 0;
  };
  void thin_out();
  void measure_penetration();
  [[nodiscard]] Found find(const Eigen::Vector3d& p_W, double link_m, double most_m,
                           const std::function<bool(const Breadcrumb&)>& is_there) const;
  [[nodiscard]] Path further(Path path, std::size_t end, double beyond_m) const;
  [[nodiscard]] Path traced(const std::vector<std::size_t>& before, std::size_t end, double length,
                            const Eigen::Vector3d& p_W) const;

  double spacing_;
  double penetration_m_ = 0.0;
  std::size_t dropped_ = 0;
  std::size_t moves_ = 0;
  std::size_t capacity_;
  std::vector<Breadcrumb> breadcrumbs_;
};

}  // namespace dive::behaviors
