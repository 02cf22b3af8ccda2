#include "planning/world/absent_objects.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace dive::planning {

void AbsentObjects::apply(std::span<const ObjectChange> changes) {
  if (changes.empty()) return;
  std::vector<int> obstacles = obstacles_ ? *obstacles_ : std::vector<int>();
  for (const ObjectChange& change : changes) {
    std::erase_if(obstacles, [&](int obstacle) {
      return obstacle >= change.first && obstacle - change.first < change.count;
    });
    if (!change.is_absent) continue;
    const auto at = std::ranges::lower_bound(obstacles, change.first);
    std::vector<int> gone(static_cast<std::size_t>(change.count));
    std::iota(gone.begin(), gone.end(), change.first);
    obstacles.insert(at, gone.begin(), gone.end());
  }
  obstacles_ =
      obstacles.empty() ? nullptr : std::make_shared<const std::vector<int>>(std::move(obstacles));
}

bool AbsentObjects::contains(int obstacle) const {
  return obstacles_ && std::ranges::binary_search(*obstacles_, obstacle);
}

World without(const World& known, const AbsentObjects& absent) {
  World world;
  world.obstacles.reserve(known.obstacles.size());
  for (std::size_t i = 0; i < known.obstacles.size(); ++i) {
    if (!absent.contains(static_cast<int>(i))) world.obstacles.push_back(known.obstacles[i]);
  }
  return world;
}

}  // namespace dive::planning
