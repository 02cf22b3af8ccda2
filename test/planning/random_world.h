#pragma once
// Random worlds and requests for the planner.

#include <cstdint>

#include "planning/planner.h"
#include "planning/world/world.h"

namespace dive::testing {

struct RandomQuestion {
  planning::World world;
  planning::PlanRequest request;
};

/// 5 to 200 boxes, cylinders and hulls of random points, in random attitudes, in 16 x 16 x 8 m of
/// water. Start and goal are at opposite sides and keep the requested clearance (0.1 to 0.6 m),
/// except perhaps in one request of twenty.
[[nodiscard]] RandomQuestion random_question(std::uint64_t seed, const planning::RobotHull& hull);

}  // namespace dive::testing
