#pragma once
// Warm starts: BiT-RRT (Devaurs, Siméon, Cortés 2013) through OMPL, in a map that holds virtual
// obstacles besides the real ones, so that it looks for a way the optimiser has not tried.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/warm_start/widest_path.h"
#include "planning/world/scene.h"

namespace dive::planning {

struct WarmStartOptions {
  /// m: a position is free when nothing is nearer. Below D_min, so that tight passages stay
  /// possible; where start or goal have less room themselves, what they have counts.
  double check_radius = 0.3;
  double preferred_clearance = 1.0;  ///< m: positions nearer than this cost the search more.
  int max_iterations = 20'000;       ///< Of the tree growth: the bound is work, not time.
  double min_z = -50.0;              ///< Depth limit, m; start and goal may lie beyond it.
  double max_z = -0.3;               ///< Highest position, m; start and goal may lie beyond it.
  double margin = 5.0;  ///< m around start and goal that is searched first, then around the map.
};

/// A ball that exists for the motion planner only.
struct VirtualObstacle {
  Eigen::Vector3d centre_W;
  double radius = 0.0;
};

class WarmStart {
 public:
  explicit WarmStart(const World& world, WarmStartOptions options = {});
  WarmStart(WarmStart&&) noexcept;
  ~WarmStart();

  void set_options(const WarmStartOptions& options);

  /// A collision-free polyline of positions from start to goal, shortened and resampled to
  /// `spacing` (m) at most; nothing when none was found within the bound. Same seed, same path.
  /// Virtual obstacles that hold start or goal are shrunk until they do not.
  [[nodiscard]] std::optional<std::vector<Eigen::Vector3d>> plan(
      const Eigen::Vector3d& start_W, const Eigen::Vector3d& goal_W,
      const std::vector<VirtualObstacle>& virtual_obstacles, double spacing, std::uint64_t seed);

  /// The way with the most room, of what is worth having (`enough`, m); nothing when start and goal
  /// are not connected. Searches the region around the whole map at once, and takes up to a second.
  [[nodiscard]] std::optional<WidestPath> widest(const Eigen::Vector3d& start_W,
                                                 const Eigen::Vector3d& goal_W, double enough,
                                                 double spacing) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
