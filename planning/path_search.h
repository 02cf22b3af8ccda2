#pragma once
// The search behind Planner::plan, for one request at a time. Internal to the planner.
//
// The loop of the AquaNav paper: optimise, certify; if the certificate fails, put a virtual
// obstacle of size D_min at the costliest waypoint, plan around it by BiT-RRT, and optimise again
// from there. In addition: where the direct path fails, the vehicle's trail to the goal is tried
// before any warm start; a ball of D_min plus the hull's inner radius must pass wherever the hull
// passes, so the search for warm starts requires that; if it finds no path, the widest path on a
// grid shows whether there is any, and the clearance of the best one.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "planning/planner.h"
#include "planning/stretches.h"
#include "planning/warm_start/warm_start.h"
#include "planning/world/scene.h"

namespace dive::planning {

class PathSearch {
 public:
  /// `scene` is the scene of `world`.
  PathSearch(const World& world, const Scene& scene, const RobotHull& hull,
             const PlannerOptions& options, Clock& clock);

  /// `request` must be valid: see Planner::plan. `start_clearance` is the clearance of the start.
  /// Adds to `statistics`.
  [[nodiscard]] PlanResult run(const PlanRequest& request, double start_clearance,
                               PlannerStatistics& statistics);

  struct Attempt {
    TrajoptResult path;
    Certificate certificate;
    bool good = false;  ///< True if certified for the clearance that was tried.

    /// Replaces this attempt by `other` if that one is good, or nearer to it.
    void keep_better(Attempt&& other);
  };

  [[nodiscard]] Certifier& certifier() { return certifier_; }
  [[nodiscard]] std::string name_of(int obstacle) const;

 private:
  static constexpr double kRounding = 1e-9;  ///< Rounding error of a clearance bound, m.

  // path_search.cpp: attempts from an initial path, and where initial paths come from.
  [[nodiscard]] Attempt attempt(const std::vector<Pose>& initial);
  [[nodiscard]] Attempt attempt_at_once(const std::vector<Pose>& initial);
  [[nodiscard]] Certificate certify(std::span<const Pose> path, double cutoff);
  [[nodiscard]] TrajoptAssessment assess(std::span<const Pose> path);
  [[nodiscard]] Attempt optimise(std::span<const Pose> initial);
  [[nodiscard]] Attempt attempt_around(Attempt failed,
                                       Attempt (PathSearch::*from)(const std::vector<Pose>&));
  void reroll(std::span<const Pose> path, Attempt& best);
  void refine(int times, Attempt& best);
  [[nodiscard]] bool split(const Attempt& attempt, std::vector<Pose>& waypoints) const;
  [[nodiscard]] bool within_reach(const Attempt& attempt) const;
  bool consider(const std::vector<Pose>& initial);
  void take_last();
  bool search_warm_starts();
  std::optional<std::vector<Pose>> warm_start(std::vector<VirtualObstacle>& avoid, int number);
  [[nodiscard]] bool search_widest();
  void search_best_clearance(std::vector<Pose> initial, double bound);
  // path_search_information.cpp
  void prefer_information();
  [[nodiscard]] std::string why_not(bool connected, double bound) const;

  // path_search_stretches.cpp
  [[nodiscard]] Attempt attempt_by_stretches(const std::vector<Pose>& initial);
  void improve(std::vector<Stretch> stretches, std::vector<Pose>& path);
  [[nodiscard]] std::vector<Pose> improve_stretches(std::span<const Pose> path,
                                                    std::span<const Stretch> stretches,
                                                    std::vector<std::size_t>& joints);
  [[nodiscard]] std::vector<Pose> improve_stretch(std::span<const Pose> path,
                                                  const Stretch& stretch);
  [[nodiscard]] std::vector<bool> short_of_clearance(std::span<const Pose> path,
                                                     std::size_t around);
  [[nodiscard]] std::vector<Stretch> stretches_at(std::span<const std::size_t> joints,
                                                  std::span<const Pose> path);

  // path_search_clearance.cpp
  [[nodiscard]] bool keeps_clearance(const Attempt& attempt);
  [[nodiscard]] std::size_t first_clear(std::span<const Pose> waypoints);
  void classify();
  [[nodiscard]] NarrowPart narrow_part();

  const World& world_;
  const PlannerOptions& options_;
  Clock& clock_;
  Scene scene_;
  Trajopt trajopt_;
  Certifier certifier_;
  WarmStart warm_start_;
  double inner_radius_;  ///< Inner radius of the hull around B's origin, m.

  // State of the present request.
  const PlanRequest* request_ = nullptr;
  PlannerStatistics* statistics_ = nullptr;
  TrajoptProblem problem_;
  double start_clearance_ = 0.0;
  double cutoff_ = 0.0;  ///< Largest clearance of interest, m.
  /// True if a path that the optimiser reports as clear is certified later.
  bool is_provisional_ = false;
  PlanResult result_;
  Attempt last_;
  int nearest_ = -1;  ///< Index of the obstacle nearest to the best path so far.
};

}  // namespace dive::planning
