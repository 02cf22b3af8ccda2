#pragma once
// `dive check`: as much of a mission as can be proved on deck. Rules, plans of every leg of the
// nominal route, the way out from every leg, budgets, a simulated dive.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diagnostic.h"
#include "mission/check/fault_matrix.h"
#include "mission/check/route.h"
#include "mission/check/simulated_dive.h"
#include "mission/document/mission.h"
#include "mission/document/rules.h"
#include "planning/planner.h"

namespace dive::mission {

struct PlannedRouteLeg {
  std::string state;
  std::string goal;
  planning::PlanResult plan;
};

/// The way out from the point of the route where it is longest.
struct WayOutProof {
  double longest_m = 0.0;    ///< Back along the route to open water.
  double longest_s = 0.0;    ///< ... and up, at the mission's speed.
  double clearance_m = 0.0;  ///< Certified, of the whole route swum backwards.
  std::string state;         ///< Where that is.
  bool exists = true;        ///< False: some point has no open water behind it.
};

struct Budget {
  double distance_m = 0.0;
  double duration_s = 0.0;
  double energy_wh = 0.0;
  /// Whatever way the machine takes: until overtime ends it, and then out and up.
  double worst_duration_s = 0.0;
  double worst_energy_wh = 0.0;
  /// Where the route passes the last point from which time and charge reach out and up; none: it
  /// never does.
  struct NoReturn {
    double distance_m = 0.0;  ///< Along the route.
    std::string state;
  };
  std::optional<NoReturn> no_return;
  /// The largest share of what was usable where an overhead began (time or charge, whichever is
  /// more) that is spent when the route turns back under it, and where. A third is the divers'
  /// rule.
  double spent_under = 0.0;
  std::string spent_under_state;
};

struct CheckReport {
  std::vector<PlannedRouteLeg> legs;
  WayOutProof way_out;
  Budget budget;
  std::optional<DiveResult> dive;
  std::vector<FaultVerdict> faults;
};

struct CheckOptions {
  bool simulate = true;
  bool faults = false;  ///< Dive every fault in every state as well ...
  bool pairs = false;   ///< ... and every two of them at once.
  int threads = 1;      ///< At a time, for these.
  DiveSettings dive;
};

/// Plans every leg of the nominal route from the goal before it.
[[nodiscard]] std::vector<PlannedRouteLeg> plan_route(const Route& route,
                                                      const planning::World& world,
                                                      const planning::RobotHull& hull,
                                                      const planning::PlannerOptions& options,
                                                      std::uint64_t seed);

/// The rules of this page, as `dive check --rules` lists them after those of the document.
[[nodiscard]] std::span<const Rule> deck_rules();

/// Checks a mission that load_mission() accepted. Findings go to `diagnostics` (codes CHK-*);
/// `progress` is told what is being done.
[[nodiscard]] CheckReport check_mission(const Mission& mission, const planning::World& world,
                                        const vehicle::Model& model, const CheckOptions& options,
                                        Diagnostics& diagnostics,
                                        const std::function<void(const std::string&)>& progress);

}  // namespace dive::mission
