#pragma once
// The legs of the missions in missions/, as requests for the planner's benchmarks.

#include <string>
#include <vector>

#include "planning/planner.h"
#include "planning/world/world.h"

namespace dive::bench {

struct EnvironmentLeg {
  std::string name;
  planning::PlanRequest request;
};

struct Environment {
  planning::World world;
  planning::RobotHull hull;
  std::vector<EnvironmentLeg> legs;
};

/// Loads `missions/NAME.xml`, with the vehicle's own hull. Asserts that the mission can be read.
[[nodiscard]] Environment load_environment(const std::string& name);

}  // namespace dive::bench
