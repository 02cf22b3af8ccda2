#pragma once
// Path optimisation by sequential convex programming (Schulman et al. 2014, "Motion planning with
// sequential convex optimization and convex collision checking"; Xanthidis et al. 2020,
// "Navigation in the presence of obstacles for an agile autonomous underwater vehicle").
//
// Waypoints s_0 .. s_N in SE(3), s_0 fixed. Minimise
//     100 * length + 200 * sum_k max(0, D_min + pad - d_k)                          (paper eq. 1-3)
//       + surface, altitude, attitude and turn terms + the limits of the vehicle's motion
// over obstacles k, d_k being the signed distance between an obstacle and the convex hull of the
// vehicle at two consecutive waypoints. `pad` covers what that hull misses of the true sweep when
// the vehicle turns between them: r (1 - cos(dtheta / 2)), with r the hull's radius.

#include <optional>
#include <span>
#include <vector>

#include "common/se3.h"
#include "planning/world/scene.h"
#include "planning/world/world.h"

namespace dive::planning {

enum class AttitudeMode {
  kFree,        ///< x axis along the motion, roll free.
  kFlat,        ///< x axis along the motion, roll zero.
  kHorizontal,  ///< Roll and pitch zero, yaw along the motion (the Window's condition).
};

/// What the vehicle and its follower can do at all.
struct MotionLimits {
  double turn_rad_per_m = 1.5;         ///< Change of attitude on the way, as fast as it can be had.
  double max_turn_rad = 1.2;           ///< ... and between two waypoints.
  double max_climb_rad = 1.2;          ///< Slope of the path, up or down.
  double max_heading_error_rad = 0.3;  ///< Between the body's x axis and the motion.
  double weight = 100.0;               ///< Per metre or rad beyond.
};

struct TrajoptOptions {
  double length_weight = 100.0;    ///< Per metre (paper).
  double obstacle_weight = 200.0;  ///< Per metre of violation and obstacle (paper).
  double surface_weight = 200.0;   ///< Per metre above -D_min: the hinge max(0, z + D_min).
  double altitude_weight = 200.0;  ///< Per metre of missing altitude.
  double attitude_weight = 20.0;   ///< Per rad^2 between the x axis and the motion.
  double turn_weight = 5.0;        ///< Per rad^2 turned between waypoints.
  double upright_weight = 2.0;     ///< Times the squared sine of the bank, per waypoint.
  MotionLimits motion;
  double clearance_buffer = 0.02;       ///< m asked beyond D_min, so that the certificate holds.
  double trust_region_m = 0.5;          ///< Initial, on positions.
  double trust_region_rad = 0.5;        ///< Initial, on attitudes.
  double min_trust_region = 0.01;       ///< m; half the buffer: finer steps change nothing.
  double improvement_tolerance = 1e-3;  ///< Relative merit change that ends the loop.
  int max_iterations = 60;
};

struct TrajoptProblem {
  Pose start;
  Pose goal;  ///< Position fixed; attitude fixed when `goal_attitude_fixed`.
  bool goal_attitude_fixed = false;
  AttitudeMode attitude = AttitudeMode::kFree;
  double clearance = 0.6;  ///< D_min, m.
  /// m: when a violation up to this stays, the obstacles are made to weigh more, and more again.
  double escalate_below = 0.6;
  double min_z = -50.0;       ///< Depth limit, m (hard bound on positions).
  double max_z = 0.0;         ///< Upper limit, m (hard bound on positions).
  double min_altitude = 0.0;  ///< m above what is straight below; only a demand beyond D_min costs.
};

enum class TrajoptStatus { kConverged, kIterationLimit, kQpFailed };

struct TrajoptResult {
  TrajoptStatus status = TrajoptStatus::kQpFailed;
  std::vector<Pose> waypoints;
  double merit = 0.0;
  double length_m = 0.0;
  double violation_m = 0.0;         ///< Largest max(0, D_min - d) over segments and obstacles.
  std::vector<int> tight_segments;  ///< Those that violate D_min, ascending.
  /// Obstacle cost charged to each waypoint (half of each adjoining segment's): where a local
  /// minimum hurts most is where the warm start puts its virtual obstacle.
  std::vector<double> waypoint_cost;
  int iterations = 0;
  int qp_solves = 0;
};

class Trajopt {
 public:
  /// Keeps references: world scene and hull must outlive it.
  Trajopt(Scene& scene, const RobotHull& hull, TrajoptOptions options = {});

  /// Optimises from `initial` (at least two poses; ends are overwritten with start and goal).
  [[nodiscard]] TrajoptResult optimise(const TrajoptProblem& problem,
                                       std::span<const Pose> initial);

  /// `path` with other rolls, when those look better; see roll_search.h. Nothing otherwise, and in
  /// modes that leave no choice.
  [[nodiscard]] std::optional<std::vector<Pose>> other_rolls(const TrajoptProblem& problem,
                                                             std::span<const Pose> path);

 private:
  Scene& scene_;
  std::vector<Eigen::Vector3d> hull_vertices_;
  TrajoptOptions options_;
};

/// Straight line from start to goal with one waypoint per `spacing` m (at least 3 waypoints),
/// attitudes as `mode` asks.
[[nodiscard]] std::vector<Pose> straight_line(const Pose& start, const Pose& goal,
                                              AttitudeMode mode, double spacing);

/// Poses along a polyline of positions: attitudes follow the motion, ends as given.
[[nodiscard]] std::vector<Pose> poses_along(std::span<const Eigen::Vector3d> positions,
                                            const Pose& start, const Pose& goal, AttitudeMode mode);

}  // namespace dive::planning
