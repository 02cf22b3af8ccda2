#include "mission/simulation/simulated_conditions.h"

namespace dive::mission {

vehicle::Conditions simulated_conditions(const Mission& mission) {
  vehicle::Conditions conditions;
  conditions.start_sigma_m = mission.priors.start_m;
  conditions.declared_current = mission.current.value;
  conditions.current_sigma = mission.priors.current;
  if (mission.unknown) return conditions;
  conditions.map_shift_sigma_m = mission.priors.map_m;
  conditions.map_turn_sigma_deg = mission.priors.map_deg;
  return conditions;
}

}  // namespace dive::mission
