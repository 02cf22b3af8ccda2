#pragma once
// The contents of a report of a dive or of a plan, in the conventions of the project: W is ENU with
// z up, SI units, times since the dive began.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/se3.h"
#include "mission/executive/io.h"
#include "mission/record/collision.h"
#include "mission/record/explain.h"
#include "planning/plan.h"
#include "planning/world/world.h"

namespace dive::mission {

inline constexpr double kUnknownValue = std::numeric_limits<double>::quiet_NaN();

/// A file that the dive or the plan was made from.
struct ReportFile {
  std::string role;  ///< "mission", "map", "vehicle", "log"
  std::string name;
  std::string sha256;  ///< As `sha256sum` prints it; of the file as it was used.
};

/// The result of a dive: what `dive run --json` prints, as far as the log contains it.
struct DiveVerdict {
  std::string outcome;  ///< success, aborted, held, failure
  std::string final_state;
  std::string cause;  ///< Empty on success.
  double duration_s = 0.0;
  double distance_m = 0.0;  ///< By ground truth, else by the estimated speed.
  bool has_truth = false;   ///< Nothing below but the sigma is known without ground truth.
  NearestApproach nearest;  ///< Its obstacle is empty if unknown, or if there are no obstacles.
  std::vector<Collision> collisions;
  double final_error_m = kUnknownValue;
  double final_sigma_m = kUnknownValue;  ///< NaN without a valid estimate.
  int plans = 0;
  int replans = 0;  ///< Plans requested while a path was being followed.
};

/// One moment of a dive. NaN: not known, or not applicable.
struct DiveSample {
  double t_s = 0.0;
  std::optional<Pose> truth;     ///< True X_WB.
  std::optional<Pose> estimate;  ///< Estimated X_WB.
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Zero();                ///< Covariance of the estimated position in W, m^2.
  double cross_track_m = kUnknownValue;       ///< Estimated distance to the line p_{i-1} p_i.
  double true_cross_track_m = kUnknownValue;  ///< True distance to the same line.
  double clearance_m = kUnknownValue;  ///< Hull to map, of the true pose, else of the estimated.
  double certified_m = kUnknownValue;  ///< Certified clearance of the path being followed.
  double speed_mps = kUnknownValue;    ///< Estimated speed over ground.
  double true_speed_mps = kUnknownValue;
  double command_mps = 0.0;  ///< Commanded forward speed.
  double command_depth_m = 0.0;
  double battery = kUnknownValue;   ///< Fraction of the charge.
  double sigma_m = kUnknownValue;   ///< estimation::horizontal_sigma()
  double error_m = kUnknownValue;   ///< Horizontal error of the estimated position.
  double features = kUnknownValue;  ///< Features that updated the visual-inertial estimator.
  bool is_visual = false;           ///< The visual-inertial estimator is active.
  bool under_overhead = false;      ///< The executive has a ceiling above; see `rerun_until_s`.
  int state = 0;                    ///< Index in DiveReport::states.
  int rung = 0;                     ///< Index in DiveReport::rungs.
  int plan = -1;                    ///< Index in Report::paths of the path being followed.
};

/// A planned path.
struct ReportPath {
  std::int64_t id = 0;
  std::string state;
  std::string goal;
  std::string cause;               ///< Reason of the request.
  double asked_s = 0.0;            ///< Time of the request.
  double answered_s = 0.0;         ///< Time of the answer.
  double time_ms = kUnknownValue;  ///< Computing time; a log has none.
  bool is_replan = false;
  planning::PlanResult plan;
};

/// The exit path from a moment on.
struct ReportExit {
  double t_s = 0.0;
  bool open_above = false;                ///< Straight up is open water.
  std::vector<Eigen::Vector3d> points_W;  ///< Back along the trail; empty in open water.
};

struct ReportBreadcrumb {
  double t_s = 0.0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  bool open_above = false;
};

/// The next local goal, from a moment on.
struct LocalGoal {
  double t_s = 0.0;
  int segment = 0;
};

/// A local minimum of the true clearance below half of D_min, without contact.
struct NearMiss {
  double t_s = 0.0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  double clearance_m = 0.0;
  std::string obstacle;
};

/// A convex piece of the observed map, at the end of the dive.
struct ObservedPiece {
  double t_s = 0.0;  ///< Since when its cell was occupied.
  planning::Polytope polytope;
};

struct DiveReport {
  DiveVerdict verdict;
  std::vector<std::string> states;  ///< Names, for DiveSample::state.
  std::vector<std::string> rungs;   ///< Names, for DiveSample::rung.
  std::vector<DiveSample> samples;  ///< Ascending.
  double sample_period_s = 0.0;
  std::vector<TimedTransition> transitions;
  std::vector<Explained> events;
  std::vector<ReportExit> exits;
  std::vector<ReportBreadcrumb> trail;
  std::vector<LocalGoal> local_goals;
  std::vector<NearMiss> near_misses;
  std::vector<ObservedPiece> observed;
  std::size_t observed_pieces = 0;  ///< Pieces of the whole observed map; `observed` may be a part.
  /// Exit path, trail and overhead are not in a log: they are computed by running the executive
  /// again. They are known until this time.
  double rerun_until_s = 0.0;
  std::string rerun_problem;  ///< Why they are not known until the end; empty if they are.
  bool torn = false;          ///< The log ends before the dive did.
  bool resumed = false;       ///< The dive continued an earlier one, which has a log of its own.
  std::vector<LogGap> gaps;
};

struct Report {
  std::string title;
  std::string mission;
  std::string description;
  std::string made_by;   ///< Version of dive that wrote the report.
  std::string dived_by;  ///< Version of dive that dived; empty for a plan.
  std::uint64_t seed = 0;
  bool map_is_simulated = false;  ///< The environment is unknown to the vehicle.
  std::vector<ReportFile> files;
  std::string check;                  ///< LogHeader::check; empty for a plan.
  double clearance_required_m = 0.0;  ///< D_min
  double max_depth_m = kUnknownValue;
  double speed_mps = kUnknownValue;  ///< Speed of the mission in still water.
  planning::World world;
  planning::RobotHull hull;
  std::vector<ReportPath> paths;
  std::optional<DiveReport> dive;  ///< Absent for a plan.
};

}  // namespace dive::mission
