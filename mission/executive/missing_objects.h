#pragma once
// Reports the objects of the known map that scans see through, and those that leave the map or come
// back. Unless the mission trusts absence they stay obstacles: what is not observed once more need
// not be gone. Private to mission/executive.

#include <optional>
#include <string>
#include <vector>

#include "planning/world/obstacle_update.h"
#include "planning/world/world.h"

namespace dive::mission {

class MissingObjects {
 public:
  /// The world must outlive it.
  MissingObjects(const planning::World& world, bool trusts_absence);

  /// Called for each scan with MapAgreement::missing_object. Returns a message once for each
  /// object, after several scans.
  [[nodiscard]] std::optional<std::string> observe(int object);
  /// A change of the map, as a sentence; empty for an object that the map does not have.
  [[nodiscard]] std::optional<std::string> describe(const planning::ObjectChange& change) const;

 private:
  [[nodiscard]] bool has(int object) const {
    return object >= 0 && static_cast<std::size_t>(object) < scans_.size();
  }

  const planning::World& world_;
  bool trusts_absence_;
  std::vector<int> scans_;  ///< By object: number of scans that saw through it.
};

}  // namespace dive::mission
