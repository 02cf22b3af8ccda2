#pragma once
// Reports the objects of the known map that scans see through. They stay obstacles: what is not
// observed once more need not be gone. Private to mission/executive.

#include <optional>
#include <string>
#include <vector>

#include "planning/world/world.h"

namespace dive::mission {

class MissingObjects {
 public:
  /// The world must outlive it.
  explicit MissingObjects(const planning::World& world);

  /// Called for each scan with MapAgreement::missing_object. Returns a message once for each
  /// object, after several scans.
  [[nodiscard]] std::optional<std::string> observe(int object);

 private:
  const planning::World& world_;
  std::vector<int> scans_;  ///< By object: number of scans that saw through it.
};

}  // namespace dive::mission
