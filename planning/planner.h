#pragma once
// The planner: optimise, certify, and where the certificate fails, warm-start and try again
// (Xanthidis et al. 2020, section III-C). A path is handed on only with its certified clearance.

#include <memory>
#include <span>
#include <string>

#include "common/clock.h"
#include "common/se3.h"
#include "planning/certify/certify.h"
#include "planning/plan.h"
#include "planning/trajopt/trajopt.h"
#include "planning/world/world.h"

namespace dive::planning {

class ExpectedView;

struct PlannerOptions {
  double waypoint_spacing_m = 1.5;
  /// Views of the known map: paths where they tell the position are preferred. Null: they are not.
  std::shared_ptr<const ExpectedView> preferred_view;
  /// Length of detour (m) that is worth a metre of path without information.
  double information_weight = 1.0;
  int max_warm_starts = 12;
  TrajoptOptions trajopt;
  CertifyOptions certify;

  /// Empty when usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// Cost of one plan. Times depend on the machine and are never logged.
struct PlannerStatistics {
  int iterations = 0;         ///< Iterations of the optimiser, all attempts.
  long waypoints_solved = 0;  ///< Waypoints summed over all programmes: what the work grows with.
  double optimise_ms = 0.0;
  double warm_start_ms = 0.0;
  double certify_ms = 0.0;
  double total_ms = 0.0;
};

/// One per thread.
class Planner {
 public:
  /// `clock` is for PlannerStatistics only: the same request and seed give the same path on any
  /// machine.
  Planner(const World& world, const RobotHull& hull, const PlannerOptions& options, Clock& clock);
  Planner(Planner&&) noexcept;
  ~Planner();

  [[nodiscard]] PlanResult plan(const PlanRequest& request);
  /// Statistics of the last plan().
  [[nodiscard]] const PlannerStatistics& statistics() const;
  /// Certified clearance of any motion, e.g. a retrace.
  [[nodiscard]] Certificate certify(std::span<const Pose> waypoints);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
