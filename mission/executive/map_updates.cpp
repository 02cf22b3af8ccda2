#include "mission/executive/map_updates.h"

namespace dive::mission {

void update_map(planning::ObservedMap& map, StepInputs& inputs) {
  for (const planning::ObstacleUpdate& update : inputs.obstacles) {
    if (update.utime <= inputs.now + kMaxScanLead) static_cast<void>(map.apply(update));
  }
  inputs.observed_map = map;
}

}  // namespace dive::mission
