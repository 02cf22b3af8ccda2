#pragma once
// Path optimisation by sequential convex programming (Schulman et al. 2014, "Motion planning with
// sequential convex optimization and convex collision checking"; Xanthidis et al. 2020, "Navigation
// in the presence of obstacles for an agile autonomous underwater vehicle").
//
// Waypoints s_0 .. s_N in SE(3), s_0 fixed. Minimise
//     100 * length + 200 * sum_k max(0, D_min + pad - d_k)                          (paper eq. 1-3)
//       + surface, altitude, attitude and turn terms + the limits of the vehicle's motion
// over obstacles k, with d_k the signed distance between an obstacle and the convex hull of the
// vehicle at two consecutive waypoints. `pad` is the most that the true sweep exceeds that hull
// when the vehicle turns between them: r (1 - cos(dtheta / 2)), with r the hull's radius.

#include <optional>
#include <span>
#include <vector>

#include "common/se3.h"
#include "planning/motion_limits.h"
#include "planning/world/scene.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Physical limits of the vehicle and its path follower.
struct KinematicLimits {
  double turn_rad_per_m = 1.5;         ///< Largest change of attitude per metre of path.
  double max_turn_rad = 1.2;           ///< Largest change of attitude between two waypoints.
  double max_climb_rad = 1.2;          ///< Largest slope of the path, up or down.
  double max_heading_error_rad = 0.3;  ///< Largest angle between the body's x axis and the motion.
  double weight = 100.0;               ///< Cost per metre or rad of violation.
};

struct TrajoptOptions {
  double length_weight = 100.0;    ///< Cost per metre (paper).
  double obstacle_weight = 200.0;  ///< Cost per metre of violation and obstacle (paper).
  double surface_weight = 200.0;   ///< Cost per metre above -D_min: the hinge max(0, z + D_min).
  double altitude_weight = 200.0;  ///< Cost per metre of missing altitude.
  double attitude_weight = 20.0;   ///< Cost per rad^2 between the x axis and the motion.
  double turn_weight = 5.0;        ///< Cost per rad^2 turned between waypoints.
  double upright_weight = 2.0;     ///< Cost of the squared sine of the bank, per waypoint.
  KinematicLimits kinematics;
  /// Margin required beyond D_min so that the certificate holds, m.
  double clearance_buffer = 0.02;
  double trust_region_m = 0.5;    ///< Initial trust region of positions, m.
  double trust_region_rad = 0.5;  ///< Initial trust region of attitudes, rad.
  /// Smallest trust region, m: half the buffer; finer steps change nothing.
  double min_trust_region = 0.01;
  double improvement_tolerance = 1e-3;  ///< Relative change of merit at which the loop ends.
  int max_iterations = 60;
};

struct TrajoptProblem {
  Pose start;
  Pose goal;  ///< Goal with fixed position; attitude fixed if `goal_attitude_fixed`.
  bool goal_attitude_fixed = false;
  /// Limits of the path. Depths are hard bounds on positions; a min_altitude beyond D_min is a
  /// cost. The optimiser does not use reduced_clearance and goal_tolerance.
  MotionLimits limits;
  /// Largest remaining violation (m) at which the weight of the obstacles is increased, repeatedly.
  double escalate_below = 0.6;
};

enum class TrajoptStatus { kConverged, kIterationLimit, kQpFailed };

struct TrajoptResult {
  TrajoptStatus status = TrajoptStatus::kQpFailed;
  std::vector<Pose> waypoints;
  double merit = 0.0;
  double length_m = 0.0;
  double violation_m = 0.0;  ///< Largest max(0, D_min - d) over segments and obstacles.
  /// True if D_min is kept with a margin at which the true hull should also keep it.
  bool is_clear = false;
  std::vector<int> tight_segments;  ///< Indices of the segments that violate D_min, ascending.
  /// Obstacle cost per waypoint (half of each adjoining segment's). The warm start puts its virtual
  /// obstacle at the largest.
  std::vector<double> waypoint_cost;
  int iterations = 0;
  int qp_solves = 0;
  /// Number of waypoints over all programmes solved, a measure of the work.
  long waypoints_solved = 0;
};

/// Assessment of an unchanged path: see Trajopt::assess.
struct TrajoptAssessment {
  TrajoptResult path;           ///< Result as after a run without iterations.
  std::vector<bool> pulled;     ///< Waypoints whose own step could improve the path.
  std::vector<bool> violating;  ///< Waypoints of a segment that violates a limit.
};

class Trajopt {
 public:
  /// Stores references: the scene of the world and the hull must outlive it.
  Trajopt(Scene& scene, const RobotHull& hull, TrajoptOptions options = {});

  /// Does not change the hull's outline, which the constructor computes.
  void set_options(const TrajoptOptions& options) { options_ = options; }

  /// Optimises from `initial` (at least two poses; ends are overwritten with start and goal).
  [[nodiscard]] TrajoptResult optimise(const TrajoptProblem& problem,
                                       std::span<const Pose> initial);

  /// The initial path of optimise(), and the waypoints that it would change.
  [[nodiscard]] TrajoptAssessment assess(const TrajoptProblem& problem, std::span<const Pose> path);

  /// `path` with other rolls, if those have a lower cost; see roll_search.h. Absent otherwise, and
  /// in modes that fix the roll.
  [[nodiscard]] std::optional<std::vector<Pose>> other_rolls(const TrajoptProblem& problem,
                                                             std::span<const Pose> path);

 private:
  Scene& scene_;
  std::vector<Eigen::Vector3d> hull_vertices_;
  TrajoptOptions options_;
};

/// Straight line from start to goal with one waypoint per `spacing` m (at least 3 waypoints),
/// attitudes according to `mode`.
[[nodiscard]] std::vector<Pose> straight_line(const Pose& start, const Pose& goal,
                                              AttitudeMode mode, double spacing);

/// Poses along a polyline of positions: attitudes follow the motion, ends as given.
[[nodiscard]] std::vector<Pose> poses_along(std::span<const Eigen::Vector3d> positions,
                                            const Pose& start, const Pose& goal, AttitudeMode mode);

}  // namespace dive::planning
