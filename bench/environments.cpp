#include "bench/environments.h"

#include <utility>

#include "common/assert.h"
#include "mission/check/route.h"
#include "planning/world/sdf.h"
#include "vehicle/model.h"

namespace dive::bench {

Environment load_environment(const std::string& name) {
  Diagnostics diagnostics;
  const auto mission = mission::load_mission(
      std::string(DIVE_SOURCE_DIR) + "/missions/" + name + ".xml", diagnostics);
  DIVE_DEMAND(mission.has_value());
  auto world = planning::load_sdf(mission->map_path, diagnostics);
  DIVE_DEMAND(world.has_value());
  auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  DIVE_DEMAND(model.has_value());

  const planning::Scene scene(*world);
  const mission::Route route = mission::nominal_route(*mission, scene);
  Environment environment{std::move(*world), std::move(model->hull), {}};
  Pose at = route.start;
  for (const mission::RouteLeg& leg : route.legs) {
    const planning::PlanRequest request = behaviors::leg_request(route.settings, leg.goal, at);
    environment.legs.push_back({leg.goal.id, request});
    at = request.goal;
  }
  return environment;
}

}  // namespace dive::bench
