#pragma once
// The maps in missions/maps/.

#include <optional>
#include <stdexcept>
#include <string>

#include "planning/world/sdf.h"

namespace dive::bench {

/// Loads missions/maps/NAME.sdf; throws if it cannot be read.
[[nodiscard]] inline planning::World shipped_map(const std::string& name) {
  const std::string path = DIVE_SOURCE_DIR "/missions/maps/" + name + ".sdf";
  Diagnostics diagnostics;
  std::optional<planning::World> world = planning::load_sdf(path, diagnostics);
  if (!world) throw std::runtime_error(path + " cannot be read");
  return *std::move(world);
}

}  // namespace dive::bench
