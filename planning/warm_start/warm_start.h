#pragma once
// Warm starts: BiT-RRT (Devaurs, Siméon, Cortés 2013) through OMPL, in a map with virtual obstacles
// added to the real ones, so that it finds a path in a homotopy class that the optimiser has not
// tried.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/motion_limits.h"
#include "planning/warm_start/widest_path.h"
#include "planning/world/scene.h"

namespace dive::planning {

struct WarmStartOptions {
  /// Limits of positions: the depths, and D_min below the surface; start and goal may violate them.
  MotionLimits limits = {};
  /// Radius of a free ball around a position, m. Less than D_min, so that tight passages stay
  /// possible; reduced to the clearance of start or goal if that is less.
  double check_radius = 0.3;
  double preferred_clearance = 1.0;  ///< Clearance below which positions have a cost, m.
  int max_iterations = 20'000;       ///< Limit of tree growth: bounds the work, not the time.
  /// Margin around start and goal that is searched first, then around the map, m.
  double margin = 5.0;
};

/// A ball that only the sampling planner must avoid.
struct VirtualObstacle {
  Eigen::Vector3d centre_W;
  double radius = 0.0;
};

class WarmStart {
 public:
  explicit WarmStart(const World& world, WarmStartOptions options = {});
  /// `bounds_W` are the bounds of the scene's world.
  WarmStart(Scene scene, const Eigen::AlignedBox3d& bounds_W, WarmStartOptions options = {});
  WarmStart(WarmStart&&) noexcept;
  ~WarmStart();

  void set_options(const WarmStartOptions& options);

  /// A collision-free polyline of positions from start to goal, shortened and resampled to at most
  /// `spacing` (m); absent if none was found within the iterations. The same seed gives the same
  /// path. Virtual obstacles that contain start or goal are shrunk until they do not.
  [[nodiscard]] std::optional<std::vector<Eigen::Vector3d>> plan(
      const Eigen::Vector3d& start_W, const Eigen::Vector3d& goal_W,
      const std::vector<VirtualObstacle>& virtual_obstacles, double spacing, std::uint64_t seed);

  /// The path with the largest clearance, counted up to `enough` (m); absent if start and goal are
  /// not connected. Searches the map within 200 m of start and goal, or within their distance if
  /// that is more, and takes up to a second.
  [[nodiscard]] std::optional<WidestPath> widest(const Eigen::Vector3d& start_W,
                                                 const Eigen::Vector3d& goal_W, double enough,
                                                 double spacing) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
