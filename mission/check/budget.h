#pragma once
// Time and energy of the nominal route in the declared current: what it takes, and from where it
// still suffices to leave and surface.

#include <optional>
#include <string>
#include <vector>

#include "common/diagnostic.h"
#include "mission/check/exit_path_proof.h"
#include "mission/check/route_plan.h"
#include "mission/document/mission.h"
#include "planning/world/world.h"
#include "vehicle/model.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// When the vehicle must turn back at the latest, wherever it is on a leg.
struct TurningPoint {
  double latest_s = 0.0;      ///< Time since the mission started, s.
  double least_charge = 0.0;  ///< Fraction of the battery's charge; it leaves the reserve.
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
  std::vector<TurningPoint> turning_points;  ///< Of each leg of the route.

  /// The earliest of the turning points, with the largest of the charges.
  [[nodiscard]] std::optional<TurningPoint> first_turning_point() const;
};

[[nodiscard]] Budget make_budget(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                                 const Mission& mission, const planning::World& world,
                                 const vehicle::Model& model, const ExitPathProof& exit_path,
                                 const vehicle::Conditions& conditions);

/// Reports what exceeds the mission's time or charge (CHK-TIME, CHK-ENERGY, CHK-NO-RETURN,
/// CHK-THIRDS and their warnings).
void check_budget(const Budget& budget, const ExitPathProof& exit_path, const Mission& mission,
                  const vehicle::Conditions& conditions, Diagnostics& diagnostics);

}  // namespace dive::mission
