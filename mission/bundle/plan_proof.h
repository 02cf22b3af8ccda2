#pragma once
// The plans of a bundle, proved again where it is used: they are those of its mission, and keep the
// clearance that they claim.

#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "mission/bundle/bundle.h"
#include "mission/document/mission.h"
#include "planning/world/world.h"

namespace dive::mission {

struct PlanProof {
  std::size_t legs = 0;
  /// Least clearance proved on any leg, at most a little above what the leg asks for, m.
  double clearance_m = 0.0;
};

/// Walks the nominal route of the mission and certifies the path of each leg on it, with the
/// certifier of planning/certify. The error is a sentence with the leg: another route, a path that
/// does not lead from its start to its goal or leaves the limits of depth, less clearance than
/// asked for or claimed.
[[nodiscard]] tl::expected<PlanProof, std::string> prove_plans(const std::vector<BundledLeg>& legs,
                                                               const Mission& mission,
                                                               const planning::World& world,
                                                               const planning::RobotHull& hull);

}  // namespace dive::mission
