#pragma once
// The exit path of each moment, kept while the vehicle swims: back along the trail to open water,
// to a place with room to drift during the hold and the ascent where one is near. Private to
// mission/executive.

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "behaviors/failsafes.h"
#include "behaviors/trail.h"
#include "common/clock.h"
#include "common/map_correction.h"
#include "estimation/frame_correction.h"
#include "mission/executive/map_view.h"
#include "mission/executive/situation.h"
#include "vehicle/exit_path.h"

namespace dive::mission {

struct ExitPathOptions {
  double link_m = 0.48;        ///< As in Trail::exit_path().
  double speed = 0.4;          ///< Of the mission, m/s.
  double current_sigma = 0.0;  ///< One sigma of the unknown current, per horizontal axis, m/s.
};

/// Allocates nothing after construction. A tick costs a comparison of positions; every half metre
/// it costs a query of the map and, outside of open water with room, a pass over the stored points.
class ExitPathKeeper {
 public:
  static constexpr double kHoldInOpenWater = 15.0;  ///< s
  static constexpr double kMaxHold = 20.0;          ///< Under an overhead, s.
  /// The same near the end of the budget, during a retrace, and where it could drift too far, s.
  static constexpr double kMinHold = 5.0;

  /// The map must outlive it.
  ExitPathKeeper(const ExitPathOptions& options, MapView& map);

  /// Before the first update(): the trail recorded by an earlier executive.
  void restore(std::span<const behaviors::Trail::Breadcrumb> trail);
  /// After a loop closure: moves the points.
  void move(const MapCorrection& correction);
  /// Called once per tick with a valid estimate. `v_B`: velocity through the water, m/s.
  void update(const Situation& situation, const Eigen::Vector3d& v_B,
              const estimation::UnmodelledMotion& unmodelled, behaviors::Rung rung);

  [[nodiscard]] const vehicle::ExitPath& path() const { return path_; }

 private:
  /// Where the vehicle was, and when; 0: before a restart of the executive.
  struct Point {
    Eigen::Vector3d p_W;
    Utime utime = 0;
  };

  void add(const Point& point, bool open_above);
  void add_open(const Point& point);
  void add_point(const Point& point);
  void leave_overhead(const Eigen::Vector3d& p_W);
  void thin_out();
  void write_waypoints();
  void clear_waypoints();
  [[nodiscard]] bool has_room(const Eigen::Vector3d& p_W) const;
  [[nodiscard]] bool is_room_near(const Eigen::Vector3d& p_W) const;
  [[nodiscard]] double hold_s(const Situation& situation, behaviors::Rung rung) const;
  [[nodiscard]] double drift_speed() const;

  ExitPathOptions options_;
  MapView& map_;
  /// As swum: those before `open_` lead from open water, with room if `from_room_`, to the last
  /// point in open water, and the others from there on.
  std::vector<Point> points_;
  std::size_t open_ = 0;
  bool from_room_ = false;
  vehicle::ExitPath path_;
};

}  // namespace dive::mission
