#pragma once
// Follows a path of waypoints with the command tuple <v, h, d, o>.

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/se3.h"
#include "vehicle/command.h"

namespace dive::vehicle {

struct FollowerOptions {
  double speed = 0.4;             ///< m/s on straights; less while turning.
  double capture_radius = 0.5;    ///< D_reached, m.
  double lookahead_m = 0.8;       ///< Of the line-of-sight law.
  double turn_slowdown = 0.9;     ///< How much of the speed a large heading error takes, [0, 1].

  [[nodiscard]] std::string validate() const;
};

struct FollowerStatus {
  int segment = 0;                ///< i: following the line p_{i-1} p_i, i in [1, N].
  double cross_track_m = 0.0;     ///< Distance to that line: the paper's error.
  double along_track_m = 0.0;     ///< Progress on that line from p_{i-1}.
  double distance_to_go_m = 0.0;  ///< To the last waypoint, along the path.
  bool finished = false;          ///< The last waypoint has been reached (or its plane passed).
  bool missed = false;            ///< Finished by passing the plane outside capture_radius.
};

/// Depth is interpolated linearly in along-track progress between p_{i-1} and p_i, clamped to it:
/// the paper's printed law has the start as a fixed point and is singular at z = 0 (doc/).
/// A waypoint is reached when the distance is below D_reached *and* has passed its minimum, or
/// when the plane through it across the segment has been passed.
class Follower {
 public:
  explicit Follower(FollowerOptions options);

  /// Starts on a new path: at least two finite waypoints X_WB. A vehicle already further along
  /// starts on the segment nearest to `position_W`.
  void set_path(std::span<const Pose> waypoints, const Eigen::Vector3d& position_W);
  [[nodiscard]] bool has_path() const { return waypoints_.size() >= 2; }

  /// One control tick. Demands a path.
  [[nodiscard]] Command step(const Pose& X_WB, const Eigen::Vector3d& v_WB_B);
  [[nodiscard]] const FollowerStatus& status() const { return status_; }
  [[nodiscard]] std::span<const Pose> path() const { return waypoints_; }

 private:
  FollowerOptions options_;
  std::vector<Pose> waypoints_;
  FollowerStatus status_;
};

}  // namespace dive::vehicle
