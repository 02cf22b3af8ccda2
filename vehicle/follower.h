#pragma once
// Follows a path of waypoints with the command tuple <v, h, d, o>.
//
//   yaw    line of sight (Fossen 2011, ch. 12.3): the course leads to the point of the path
//          `lookahead_m` ahead of the vehicle's projection, round the corner where one is near; the
//          sideslip is taken off, so that it is the motion and not the nose that points there
//   roll, pitch  of the planned attitudes, interpolated along the track
//   depth  linear in along-track progress over ground between p_{i-1} and p_i, clamped to it; on
//          segments that are all but vertical a little ahead; the paper's printed law has the start
//          as a fixed point and is singular at z = 0: doc/decisions/follower-depth-law.md
//   speed  less before corners, while the heading is off, where depth cannot keep up, and at the
//   end

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/se3.h"
#include "vehicle/command.h"

namespace dive::vehicle {

struct FollowerOptions {
  double speed = 0.4;                         ///< m/s on straights; less while turning.
  double capture_radius = 0.5;                ///< D_reached, m.
  std::optional<double> last_capture_radius;  ///< Of the last waypoint, m; capture_radius if none.
  double lookahead_m = 0.65;                  ///< Of the line-of-sight law.
  double turn_slowdown = 0.9;    ///< How much of the speed a large heading error takes, [0, 1].
  double corner_slowdown = 0.7;  ///< How much of the speed a corner of 90 degrees takes, [0, 1].
  double arrival_speed = 0.15;   ///< m/s at the last waypoint.
  double braking_s = 1.0;        ///< Time constant with which the speed follows the command.
  double heave_speed = 0.13;     ///< m/s of depth that the vehicle can change beside its pitch.
  double depth_lead_m = 0.4;     ///< On a segment that is all but vertical.

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

/// A waypoint is reached when the distance is below D_reached *and* has passed its minimum, or
/// when the plane through it across the segment has been passed.
class Follower {
 public:
  explicit Follower(FollowerOptions options);

  /// Starts on a new path: at least two finite waypoints X_WB. A vehicle already further along
  /// starts on the segment nearest to `position_W`.
  void set_path(std::span<const Pose> waypoints, const Eigen::Vector3d& position_W);
  [[nodiscard]] bool has_path() const { return waypoints_.size() >= 2; }

  /// One control tick. Demands a path. Allocates nothing.
  [[nodiscard]] Command step(const Pose& X_WB, const Eigen::Vector3d& v_WB_B);
  [[nodiscard]] const FollowerStatus& status() const { return status_; }
  [[nodiscard]] std::span<const Pose> path() const { return waypoints_; }

 private:
  /// The line from one waypoint to the next.
  struct Segment {
    Eigen::Vector3d start;
    Eigen::Vector3d direction;  ///< Unit; of a segment of no length, x of the planned attitude.
    double length = 0.0;        ///< m
    double bearing = 0.0;       ///< rad; of a vertical one, the planned yaw.
    double remaining = 0.0;     ///< m of path from its end on.
    double corner = 0.0;        ///< rad between its bearing and the next one's, >= 0.
  };

  [[nodiscard]] static Segment make_segment(const Pose& from, const Pose& to);
  [[nodiscard]] const Segment& segment() const;
  [[nodiscard]] double capture_radius() const;
  void observe(const Eigen::Vector3d& p_W);
  [[nodiscard]] bool passed(const Eigen::Vector3d& p_W);
  void advance(const Eigen::Vector3d& p_W);
  [[nodiscard]] double course(const Eigen::Vector3d& p_W) const;
  [[nodiscard]] double depth_progress(const Eigen::Vector3d& p_W) const;
  /// `left` (rad, >= 0) is the angle between the segment and where swimming along x leads.
  [[nodiscard]] double speed_towards(double heading_error, double depth_error, double left) const;

  FollowerOptions options_;
  std::vector<Pose> waypoints_;
  std::vector<Segment> segments_;
  FollowerStatus status_;
  double nearest_m_ = 0.0;  ///< Smallest distance to the waypoint ahead so far.
};

}  // namespace dive::vehicle
