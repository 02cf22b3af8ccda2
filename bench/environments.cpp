#include "bench/environments.h"

#include <utility>

#include "bench/study_setup.h"
#include "mission/check/route.h"

namespace dive::bench {

Environment load_environment(const std::string& name) {
  StudySetup setup = load_shipped_setup(name);
  const planning::Scene scene(setup.world);
  const mission::Route route = mission::nominal_route(setup.mission, scene);
  Environment environment{std::move(setup.world), std::move(setup.model.hull), {}};
  Pose at = route.start;
  for (const mission::RouteLeg& leg : route.legs) {
    const planning::PlanRequest request = behaviors::leg_request(route.settings, leg.goal, at);
    environment.legs.push_back({leg.goal.id, request});
    at = request.goal;
  }
  return environment;
}

}  // namespace dive::bench
