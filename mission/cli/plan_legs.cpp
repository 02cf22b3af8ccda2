#include "mission/cli/plan_legs.h"

#include "mission/cli/work_progress.h"

namespace dive::mission {

std::vector<PlannedRouteLeg> plan_legs(const LoadedMission& loaded, const Route& route,
                                       std::uint64_t seed, bool is_quiet) {
  SteadyClock clock;
  WorkProgress progress(clock, "planning", is_quiet);
  std::vector<PlannedRouteLeg> legs = plan_route(
      route, loaded.mission, loaded.world, loaded.model.hull, planning::PlannerOptions{}, seed,
      [&](std::size_t planned) {
        progress.show(static_cast<double>(planned) / static_cast<double>(route.legs.size()));
      });
  progress.clear();
  return legs;
}

}  // namespace dive::mission
