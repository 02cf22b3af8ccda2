#pragma once
// Follows a path of waypoints with the command tuple <v, h, d, o>.
//
//   yaw    line of sight (Fossen 2011, ch. 12.3): the course leads to the point of the path
//          `lookahead_m` ahead of the vehicle's projection, round the corner where one is near; the
//          sideslip is subtracted, so that the motion and not the nose points there
//   roll, pitch  of the planned attitudes, interpolated along the track
//   depth  linear in along-track progress over ground between p_{i-1} and p_i, clamped to it; a
//          little ahead on nearly vertical segments; the paper's printed law has the start as a
//          fixed point and is singular at z_{i-1} = 0: doc/decisions/follower-depth-law.md
//   speed  reduced before corners, during a heading error, while the nose does not yet point up or
//          down the slope, where depth cannot keep up, and at the end; a vehicle on its side needs
//          way to hold its depth, and is not slowed for it; against a known current a reduced speed
//          is one over ground, up to the full speed through the water

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/se3.h"
#include "vehicle/command.h"

namespace dive::vehicle {

/// Largest crab angle: a larger one feeds back on itself, rad.
inline constexpr double kMaxCrab = 0.5;

struct FollowerOptions {
  double speed = 0.4;                         ///< Speed on straights, m/s; reduced in turns.
  double capture_radius = 0.5;                ///< D_reached, m.
  std::optional<double> last_capture_radius;  ///< D_reached at the end, m; else capture_radius.
  double lookahead_m = 0.65;                  ///< Lookahead distance of the line-of-sight law.
  double turn_slowdown = 0.9;    ///< Relative slowdown by a large heading error, [0, 1].
  double corner_slowdown = 0.7;  ///< Relative slowdown by a corner of 90 degrees, [0, 1].
  double arrival_speed = 0.15;   ///< Speed at the last waypoint, m/s.
  double braking_s = 1.0;        ///< Time constant of the speed's response to the command.
  double heave_speed = 0.13;     ///< Rate of depth change without pitch, m/s.
  double depth_lead_m = 0.4;     ///< Lead of the commanded depth on a nearly vertical segment.

  [[nodiscard]] std::string validate() const;
};

struct FollowerStatus {
  int segment = 0;                ///< i: following the line p_{i-1} p_i, i in [1, N].
  double cross_track_m = 0.0;     ///< Distance to that line: the paper's error.
  double along_track_m = 0.0;     ///< Progress on that line from p_{i-1}.
  double distance_to_go_m = 0.0;  ///< Distance to the last waypoint along the path.
  bool finished = false;          ///< True after the last waypoint (or its plane).
  bool missed = false;            ///< True if finished by passing the plane outside capture_radius.
};

/// A waypoint is reached when the distance is below D_reached *and* has passed its minimum, or
/// when the plane through it across the segment has been passed.
class Follower {
 public:
  explicit Follower(FollowerOptions options);

  /// Starts a new path: at least two finite waypoints X_WB. A vehicle already further along starts
  /// on the segment nearest to `position_W`.
  void set_path(std::span<const Pose> waypoints, const Eigen::Vector3d& position_W);
  [[nodiscard]] bool has_path() const { return waypoints_.size() >= 2; }

  /// One control tick. `current_W`: known velocity of the water over ground, m/s. Demands a path.
  /// Does not allocate.
  [[nodiscard]] Command step(const Pose& X_WB, const Eigen::Vector3d& v_WB_B,
                             const Eigen::Vector2d& current_W = Eigen::Vector2d::Zero());
  [[nodiscard]] const FollowerStatus& status() const { return status_; }
  [[nodiscard]] std::span<const Pose> path() const { return waypoints_; }
  /// Sets `way` to the path from X_WB onwards, up to a length of `max_m`: X_WB and the next
  /// waypoints, the last one interpolated. Demands a path.
  void way_ahead(const Pose& X_WB, double max_m, std::vector<Pose>& way) const;

 private:
  /// The line from one waypoint to the next.
  struct Segment {
    Eigen::Vector3d start;
    Eigen::Vector3d direction;  ///< Unit; for zero length, x of the planned attitude.
    double length = 0.0;        ///< m
    double bearing = 0.0;       ///< Bearing, rad; for a vertical segment, the planned yaw.
    double remaining = 0.0;     ///< Length of path after its end, m.
    double corner = 0.0;        ///< Angle between its bearing and the next one's, rad, >= 0.
  };

  [[nodiscard]] static Segment make_segment(const Pose& from, const Pose& to);
  [[nodiscard]] const Segment& segment() const;
  [[nodiscard]] double capture_radius() const;
  void observe(const Eigen::Vector3d& p_W);
  [[nodiscard]] bool passed(const Eigen::Vector3d& p_W);
  void advance(const Eigen::Vector3d& p_W);
  [[nodiscard]] double course(const Eigen::Vector3d& p_W) const;
  [[nodiscard]] double depth_progress(const Eigen::Vector3d& p_W) const;
  /// `against` (m/s, >= 0) is the current's speed against the segment. `left` (rad, >= 0) is the
  /// angle between the slopes of the segment and of x of B. `heave_share` in [0, 1]: how
  /// vertical z of B is.
  [[nodiscard]] double speed_towards(double against, double heading_error, double depth_error,
                                     double left, double heave_share) const;

  FollowerOptions options_;
  std::vector<Pose> waypoints_;
  std::vector<Segment> segments_;
  FollowerStatus status_;
  double nearest_m_ = 0.0;  ///< Smallest distance to the next waypoint so far.
};

}  // namespace dive::vehicle
