#pragma once
// The mission, worlds and vehicle of a bundle.

#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "mission/bundle/bundle.h"
#include "mission/document/mission.h"
#include "planning/world/world.h"
#include "vehicle/model.h"

namespace dive::mission {

struct BundledDive {
  Mission mission;
  planning::World world;  ///< As LoadedMission::world, meshes with their triangles.
  std::optional<planning::World> simulated_world;  ///< If it is not the map.
  vehicle::Model model;
};

/// Reads nothing but the bundle. The error is a sentence: one of them is not accepted.
[[nodiscard]] tl::expected<BundledDive, std::string> bundled_dive(const Bundle& bundle);

}  // namespace dive::mission
