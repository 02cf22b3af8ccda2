#pragma once
// The exit path of each moment, kept while the vehicle swims: back along the trail to open water.
// Private to mission/executive.

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "behaviors/failsafes.h"
#include "behaviors/trail.h"
#include "estimation/frame_correction.h"
#include "mission/executive/situation.h"
#include "vehicle/exit_path.h"

namespace dive::mission {

/// Allocates nothing after construction. A tick costs a comparison of positions, and every half
/// metre under an overhead a pass over the stored points.
class ExitPathKeeper {
 public:
  static constexpr double kHoldInOpenWater = 15.0;  ///< s
  static constexpr double kMaxHold = 20.0;          ///< Under an overhead, s.
  static constexpr double kMinHold =
      5.0;  ///< The same, near the end of the budget; while retreating.

  /// `link_m`: as in Trail::exit_path(). `speed`: of the mission, m/s.
  ExitPathKeeper(double link_m, double speed);

  /// Before the first update(): the trail recorded by an earlier executive.
  void restore(std::span<const behaviors::Trail::Breadcrumb> trail);
  /// Called once per tick with a valid estimate. `v_B`: velocity through the water, m/s.
  void update(const Situation& situation, const Eigen::Vector3d& v_B,
              const estimation::UnmodelledMotion& unmodelled, behaviors::Rung rung);

  [[nodiscard]] const vehicle::ExitPath& path() const { return path_; }

 private:
  void add(const Eigen::Vector3d& p_W, bool open_above);
  void leave_overhead(const Eigen::Vector3d& p_W);
  void thin_out();
  void write_waypoints();

  double link_m_;
  std::vector<Eigen::Vector3d> points_;  ///< As swum: the first `open_` in open water.
  std::size_t open_ = 0;
  vehicle::ExitPath path_;
};

}  // namespace dive::mission
