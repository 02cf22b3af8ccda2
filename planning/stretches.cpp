#include "planning/stretches.h"

#include <algorithm>

namespace dive::planning {

std::vector<Stretch> find_stretches(const std::vector<bool>& pulled,
                                    const std::vector<bool>& violating) {
  const std::size_t count = pulled.size();
  const auto to_move = [&](std::size_t i) { return pulled[i] || violating[i]; };
  std::vector<Stretch> result;
  std::size_t done = 0;  // end of the last stretch
  for (std::size_t i = 0; i < count; ++i) {
    if (!to_move(i)) continue;
    Stretch stretch;
    stretch.first = std::max(done, i - std::min(i, kStretchMargin));
    std::size_t last_to_move = i;
    bool is_cut = false;
    std::size_t k = i + 1;
    for (; k < count && k <= last_to_move + 2 * kStretchMargin && !is_cut; ++k) {
      is_cut = k - stretch.first >= kLongStretch && !violating[k];
      if (to_move(k)) last_to_move = k;
    }
    stretch.last = is_cut ? k - 1 : std::min(last_to_move + kStretchMargin, count - 1);
    result.push_back(stretch);
    done = stretch.last;
    i = stretch.last;
  }
  return result;
}

}  // namespace dive::planning
