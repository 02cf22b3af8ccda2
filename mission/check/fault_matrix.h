#pragma once
// Every survivable fault in every state of the nominal dive, at several instants, each in a
// separate dive that runs to its end: it must end at the surface, or safely held, without a
// collision.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "mission/simulation/simulated_dive.h"

namespace dive::mission {

/// The fault-free dive from which instants are drawn.
struct NominalDive {
  DiveResult result;
  std::vector<bool> under_overhead;  ///< Per control tick: something solid is above the vehicle.
};

struct FaultCase {
  std::string state;  ///< Atomic state active at the onset of the faults.
  std::vector<Fault> faults;
  bool under_overhead = false;  ///< Overhead at the onset of the faults.
};

struct FaultResult {
  FaultCase fault;
  DiveResult dive;  ///< Without the map made by a dive in an unknown environment.
  bool surfaced = false;
  bool held = false;

  [[nodiscard]] bool is_safe() const { return (surfaced || held) && dive.collisions.empty(); }
};

/// True if the dive ended at the surface, and not in failure.
[[nodiscard]] bool has_surfaced(const DiveResult& dive);

/// The faults, the state and the end of the dive: "leak at 12.34 s in 'in' collides ...".
[[nodiscard]] std::string describe(const FaultResult& result);

struct FaultDraw {
  std::uint64_t seed = 1;
  int instants = 3;       ///< Instants of each fault in each state.
  int pair_instants = 0;  ///< Instants of every pair of faults in each state.
};

/// The dives for every fault that `mission` can suffer, in every atomic state in which `nominal`
/// stayed. Instants are multiples of a control tick and are drawn separately for each fault: one
/// soon after entry and one shortly before exit, the others anywhere between. (A single one is
/// drawn from the whole stay.) Sorted so that findings are expected early: each fault in each state
/// once before any twice, under an overhead before in open water, single faults before pairs.
[[nodiscard]] std::vector<FaultCase> draw_fault_cases(const Mission& mission,
                                                      const NominalDive& nominal,
                                                      const FaultDraw& draw);

/// Fraction of the work that is done, for the remaining time. The durations of dives differ by more
/// than a factor of ten, so a count of dives is a poor measure: a dive is expected to last after
/// its faults as long as the finished dives did on average.
class FaultProgress {
 public:
  explicit FaultProgress(const std::vector<FaultCase>& cases);

  /// A dive has ended.
  void add(const FaultResult& result);
  /// Fraction in [0, 1] of the simulated seconds.
  [[nodiscard]] double share() const;

 private:
  double dived_s_ = 0.0;
  double after_faults_s_ = 0.0;   ///< Sum over the finished dives.
  double before_faults_s_ = 0.0;  ///< Sum over the remaining dives.
  std::size_t ended_ = 0;
  std::size_t left_ = 0;
};

/// Called after each dive, from one thread at a time; `done` dives have finished.
using FaultObserver = std::function<void(std::size_t done, const FaultResult& result)>;

/// Simulates the cases, `threads` at a time and started in their order; the results are in the same
/// order.
[[nodiscard]] std::vector<FaultResult> dive_with_faults(const std::vector<FaultCase>& cases,
                                                        const Mission& mission,
                                                        const planning::World& world,
                                                        const vehicle::Model& model,
                                                        const DiveSettings& settings, int threads,
                                                        const FaultObserver& observer);

}  // namespace dive::mission
