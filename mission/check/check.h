#pragma once
// `dive check`: everything about a mission that can be proved on deck. Rules, plans of every leg of
// the nominal route, exit paths from every leg, budgets, a simulated dive.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diagnostic.h"
#include "mission/check/fault_matrix.h"
#include "mission/check/route.h"
#include "mission/document/mission.h"
#include "mission/document/rules.h"
#include "mission/simulation/simulated_dive.h"
#include "planning/planner.h"

namespace dive::mission {

struct PlannedRouteLeg {
  std::string state;
  std::string goal;
  planning::PlanResult plan;
  planning::PlannerStatistics statistics;
};

/// The exit path from the point of the route where it is longest.
struct ExitPathProof {
  double longest_m = 0.0;    ///< Length back along the route to open water.
  double longest_s = 0.0;    ///< Time back along the route and up, at the mission's speed.
  double clearance_m = 0.0;  ///< Certified clearance of the whole route swum backwards.
  std::string state;         ///< State with the longest exit path.
  bool exists = true;        ///< False: no open water precedes some point of the route.
};

struct Budget {
  double distance_m = 0.0;
  double duration_s = 0.0;
  double energy_wh = 0.0;
  /// Upper bound over all runs of the machine: up to the mission timeout, then out and up.
  double worst_duration_s = 0.0;
  double worst_energy_wh = 0.0;
  /// The last point of the route from which time and charge suffice to swim out and up; absent:
  /// every point.
  struct NoReturn {
    double distance_m = 0.0;  ///< Distance along the route.
    std::string state;
  };
  std::optional<NoReturn> no_return;
  /// The largest share of the time or charge (the larger) usable where an overhead began that is
  /// used when the route turns back under it, and where. The divers' rule is a third.
  double budget_used_under_overhead = 0.0;
  std::string worst_overhead_state;
};

struct CheckReport {
  std::vector<PlannedRouteLeg> legs;
  ExitPathProof exit_path;
  Budget budget;
  std::optional<DiveResult> dive;
  std::vector<FaultResult> faults;
};

struct CheckOptions {
  bool simulate = true;
  bool faults = false;  ///< Also dive every fault in every state.
  int instants = 3;     ///< Instants of each fault in each state.
  /// Instants of every pair of faults in each state; 0: single faults only.
  int pair_instants = 0;
  int threads = 1;  ///< Threads for the dives with faults.
  DiveSettings dive;
};

/// Receives the progress of check_mission(), from one thread at a time; the defaults do nothing.
class CheckObserver {
 public:
  virtual ~CheckObserver() = default;
  /// A step begins.
  virtual void on_step(const std::string& /*what*/) {}
  /// Progress of the present step in a unit of its own ("s of the dive", "dives"), and the fraction
  /// of its work that is done, for an estimate of the remaining time; above 1 when the step takes
  /// longer than expected.
  virtual void on_progress(double /*done*/, double /*total*/, const std::string& /*unit*/,
                           double /*share*/) {}
  /// A dive with faults has ended unsafely; `command` repeats it.
  virtual void on_finding(const FaultResult& /*result*/, const std::string& /*command*/) {}
};

/// Plans every leg of the nominal route from the previous goal. A reduced path is accepted where
/// the mission allows it: RouteLeg::reduced_clearance.
[[nodiscard]] std::vector<PlannedRouteLeg> plan_route(const Route& route,
                                                      const planning::World& world,
                                                      const planning::RobotHull& hull,
                                                      const planning::PlannerOptions& options,
                                                      std::uint64_t seed);

/// The rules of this header, listed by `dive check --rules` after those of the document.
[[nodiscard]] std::span<const Rule> deck_rules();

/// Checks a mission that load_mission() accepted. Findings go to `diagnostics` (codes CHK-*);
/// findings of dives with faults reach `observer` immediately.
[[nodiscard]] CheckReport check_mission(const Mission& mission, const planning::World& world,
                                        const vehicle::Model& model, const CheckOptions& options,
                                        Diagnostics& diagnostics, CheckObserver& observer);

}  // namespace dive::mission
