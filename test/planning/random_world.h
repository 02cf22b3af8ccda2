#pragma once
// Random worlds and questions for the planner.

#include <cstdint>

#include "planning/planner.h"
#include "planning/world/world.h"

namespace dive::testing {

struct RandomQuestion {
  planning::World world;
  planning::PlanRequest request;
};

/// 5 to 200 boxes, cylinders and hulls of random points, anyhow turned, in 16 x 16 x 8 m of water;
/// start and goal at opposite sides, clear of everything by the clearance that is asked for (0.1 to
/// 0.6 m) except, perhaps, in one of twenty.
[[nodiscard]] RandomQuestion random_question(std::uint64_t seed, const planning::RobotHull& hull);

}  // namespace dive::testing
