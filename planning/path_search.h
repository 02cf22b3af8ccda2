#pragma once
// The search behind Planner::plan, for one request at a time. Internal to the planner.
//
// The paper's loop: optimise, certify; where the certificate fails, put a virtual obstacle of size
// D_min at the costliest waypoint, plan around it by BiT-RRT, start again from there. Around it:
// a ball of D_min and the hull's inner radius must pass wherever the hull does, so the search for
// warm starts asks for that; when it finds nothing, the widest path on a grid says whether there is
// anything at all, and how much clearance the best way leaves.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "planning/planner.h"
#include "planning/world/scene.h"

namespace dive::planning {

class PathSearch {
 public:
  PathSearch(const World& world, const RobotHull& hull, const PlannerOptions& options,
             Clock& clock);

  /// `request` must make sense: see Planner::plan. `start_clearance` is what the start keeps.
  [[nodiscard]] PlanResult run(const PlanRequest& request, double start_clearance,
                               StageTimes& times);

  struct Attempt {
    TrajoptResult path;
    Certificate certificate;
    bool good = false;  ///< Certified for the clearance that was tried.
  };

  [[nodiscard]] Certifier& certifier() { return certifier_; }
  [[nodiscard]] std::string name_of(int obstacle) const;

 private:
  [[nodiscard]] Attempt attempt(const std::vector<Pose>& initial);
  [[nodiscard]] Attempt optimise(std::span<const Pose> initial);
  void reroll(std::span<const Pose> path, Attempt& best);
  void refine(int times, Attempt& best);
  [[nodiscard]] bool split(const Attempt& attempt, std::vector<Pose>& waypoints) const;
  [[nodiscard]] bool keeps_clearance(const Attempt& attempt);
  [[nodiscard]] bool within_reach(const Attempt& attempt) const;
  bool consider(const std::vector<Pose>& initial);
  bool search_warm_starts();
  std::optional<std::vector<Pose>> warm_start(int number);
  void search_widest();
  void search_best_clearance(std::vector<Pose> initial, double bound);
  [[nodiscard]] std::string why_not(bool connected, double bound) const;

  const World& world_;
  const PlannerOptions& options_;
  Clock& clock_;
  Scene scene_;
  Trajopt trajopt_;
  Certifier certifier_;
  WarmStart warm_start_;
  double inner_radius_;  ///< Of the hull around B's origin.

  // Of the present request:
  const PlanRequest* request_ = nullptr;
  StageTimes* times_ = nullptr;
  TrajoptProblem problem_;
  double start_clearance_ = 0.0;
  std::vector<VirtualObstacle> avoid_;
  PlanResult result_;
  Attempt last_;
  int nearest_ = -1;  ///< Obstacle nearest to the best path so far.
};

}  // namespace dive::planning
