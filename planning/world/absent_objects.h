#pragma once
// The objects of the known map that are gone, as observed during a dive.

#include <memory>
#include <span>
#include <vector>

#include "planning/world/obstacle_update.h"
#include "planning/world/world.h"

namespace dive::planning {

/// A value: a copy shares its content and never changes. Snapshots may be read by several threads.
class AbsentObjects {
 public:
  /// Applies well-formed changes.
  void apply(std::span<const ObjectChange> changes);

  [[nodiscard]] bool empty() const { return !obstacles_; }
  /// True if the obstacle of the known map with this index is part of an object that is gone.
  [[nodiscard]] bool contains(int obstacle) const;

  friend bool operator==(const AbsentObjects&, const AbsentObjects&) = default;

 private:
  /// Ascending; null: none. Replaced at every change, so that pointers compare as values.
  std::shared_ptr<const std::vector<int>> obstacles_;
};

/// The obstacles that are there, without surfaces.
[[nodiscard]] World without(const World& known, const AbsentObjects& absent);

}  // namespace dive::planning
