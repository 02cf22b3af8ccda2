#include "bench/environments.h"

#include <utility>

#include "bench/site.h"
#include "mission/check/route.h"

namespace dive::bench {

Environment load_environment(const std::string& name) {
  Site site = load_shipped_site(name);
  const planning::Scene scene(site.world);
  const mission::Route route = mission::nominal_route(site.mission, scene);
  Environment environment{std::move(site.world), std::move(site.model.hull), {}};
  Pose at = route.start;
  for (const mission::RouteLeg& leg : route.legs) {
    const planning::PlanRequest request = behaviors::leg_request(route.settings, leg.goal, at);
    environment.legs.push_back({leg.goal.id, request});
    at = request.goal;
  }
  return environment;
}

}  // namespace dive::bench
