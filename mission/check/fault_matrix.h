#pragma once
// Every survivable fault in every state of the nominal dive, each in a dive of its own: it must end
// at the surface or held in its place, and never in a collision.

#include <functional>
#include <string>
#include <vector>

#include "mission/check/simulated_dive.h"

namespace dive::mission {

struct FaultCase {
  std::string state;  ///< Leaf that is active when the fault begins.
  std::vector<Fault> faults;
};

struct FaultVerdict {
  FaultCase fault;
  DiveResult dive;
  bool surfaced = false;
  bool held = false;

  [[nodiscard]] bool is_safe() const { return (surfaced || held) && dive.collisions == 0; }
};

/// One case for every fault that `mission` can suffer, in the middle of every leaf that `nominal`
/// went through.
[[nodiscard]] std::vector<FaultCase> every_fault_in_every_state(const Mission& mission,
                                                                const DiveResult& nominal);

/// The same for every two of them at once.
[[nodiscard]] std::vector<FaultCase> every_pair_in_every_state(const Mission& mission,
                                                               const DiveResult& nominal);

/// Dives them, `threads` at a time; `progress` is told how many are done.
[[nodiscard]] std::vector<FaultVerdict> dive_with_faults(
    const std::vector<FaultCase>& cases, const Mission& mission, const planning::World& world,
    const vehicle::Model& model, const DiveSettings& settings, int threads,
    const std::function<void(std::size_t)>& progress);

}  // namespace dive::mission
