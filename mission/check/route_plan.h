#pragma once
// Paths for the legs of the nominal route.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "behaviors/trail.h"
#include "common/diagnostic.h"
#include "mission/check/route.h"
#include "mission/document/mission.h"
#include "planning/certify/position_margin.h"
#include "planning/planner.h"

namespace dive::mission {

/// The least margin of a leg and where it is.
struct LegMargin : planning::PositionMargin {
  std::string obstacle_name;  ///< That of the obstacle nearest there.
  /// Standard deviation of the position at the end of the leg, along its worst horizontal axis, m.
  double end_sigma_m = 0.0;
};

struct PlannedRouteLeg {
  std::string state;
  std::string goal;
  planning::PlanResult plan;
  planning::PlannerStatistics statistics;
  LegMargin margin = {};  ///< Margin of an accepted plan; see position_margin.h.
};

/// The requests to the planner for the legs of a route, in turn.
class RouteRequests {
 public:
  /// `route` must outlive this object.
  RouteRequests(const Route& route, std::uint64_t seed);
  /// The request for the next leg, which begins where the path of the one before ended.
  [[nodiscard]] const planning::PlanRequest& next();
  /// Takes the path of that leg; without one the next leg begins at its goal.
  void arrive(const std::vector<Pose>& path);

 private:
  const Route& route_;
  behaviors::LegSettings settings_;
  planning::PlanRequest request_;
  Pose at_;
  behaviors::Trail trail_;
  std::size_t leg_ = 0;
};

using RouteObserver = std::function<void(std::size_t legs)>;

/// Plans every leg of the nominal route from the previous goal. A reduced path is accepted where
/// the mission allows it: RouteLeg::reduced_clearance. `planned` is called after each leg with the
/// number of legs that are planned; it may be empty.
[[nodiscard]] std::vector<PlannedRouteLeg> plan_route(const Route& route, const Mission& mission,
                                                      const planning::World& world,
                                                      const planning::RobotHull& hull,
                                                      const planning::PlannerOptions& options,
                                                      std::uint64_t seed,
                                                      const RouteObserver& planned = nullptr);

/// True for a clearance at the certifier's cutoff: it may be larger.
[[nodiscard]] bool is_cut_off(double clearance_m);
/// "1.26 m", or "at least 5.00 m" for a clearance at the certifier's cutoff.
[[nodiscard]] std::string certified_text(double clearance_m, int decimals = 2);

/// Reports legs without an accepted path (CHK-PLAN).
void report_failed_plans(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                         const Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
