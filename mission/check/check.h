#pragma once
// `dive check`: everything about a mission that can be proved on deck. Rules, plans of every leg of
// the nominal route, progress against the declared current, exit paths from every leg, budgets,
// simulated dives.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/diagnostic.h"
#include "mission/check/budget.h"
#include "mission/check/current_check.h"
#include "mission/check/dive_series.h"
#include "mission/check/exit_path_proof.h"
#include "mission/check/fault_matrix.h"
#include "mission/check/route_plan.h"
#include "mission/document/mission.h"
#include "mission/document/rules.h"
#include "mission/simulation/simulated_dive.h"

namespace dive::mission {

struct CheckReport {
  std::vector<PlannedRouteLeg> legs;
  RouteTimes times;
  std::vector<std::optional<LeastProgress>>
      progress;  ///< Progress of each leg in the declared current.
  ExitPathProof exit_path;
  Budget budget;
  std::optional<DiveResult> dive;   ///< The first simulated dive.
  std::optional<DiveSeries> dives;  ///< All of them.
  std::vector<FaultResult> faults;
};

struct CheckOptions {
  bool simulate = true;
  std::optional<int> dives = 1;  ///< Number of simulated dives: SeriesOptions::dives.
  bool faults = false;           ///< Also dive every fault in every state.
  int instants = 3;              ///< Instants of each fault in each state.
  /// Instants of every pair of faults in each state; 0: single faults only.
  int pair_instants = 0;
  /// Dives with faults draw a current too. A vehicle that has lost its attitude under an overhead
  /// is carried away by it: doc/decisions/blind-and-safely-held.md.
  bool fault_current = false;
  int threads = 1;  ///< Threads for the simulated dives.
  DiveSettings dive;
};

/// Receives the progress of check_mission(), from one thread at a time; the defaults do nothing.
class CheckObserver {
 public:
  virtual ~CheckObserver() = default;
  /// A step begins.
  virtual void on_step(const std::string& /*what*/) {}
  /// Progress of the present step in a unit of its own ("s of the dive", "dives"; the total may be
  /// an estimate), and the fraction of its work that is done, for an estimate of the remaining
  /// time; above 1 when the step takes longer than expected.
  virtual void on_progress(double /*done*/, double /*total*/, const std::string& /*unit*/,
                           double /*share*/) {}
  /// A dive with faults has ended unsafely; `command` repeats it.
  virtual void on_finding(const FaultResult& /*result*/, const std::string& /*command*/) {}
};

/// The rules of this header, listed by `dive check --rules` after those of the document.
[[nodiscard]] std::span<const Rule> deck_rules();

/// Checks a mission that load_mission() accepted. Findings go to `diagnostics` (codes CHK-*);
/// findings of dives with faults reach `observer` immediately. `clock` decides the number of dives
/// if the options leave it open.
[[nodiscard]] CheckReport check_mission(const Mission& mission, const planning::World& world,
                                        const vehicle::Model& model, const CheckOptions& options,
                                        Diagnostics& diagnostics, CheckObserver& observer,
                                        Clock& clock);

}  // namespace dive::mission
