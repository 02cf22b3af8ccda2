#pragma once
// The input of a study: a mission, its world, and the vehicle.

#include <stdexcept>
#include <string>
#include <utility>

#include "mission/document/mission.h"
#include "planning/world/sdf.h"
#include "vehicle/model.h"

namespace dive::bench {

struct StudySetup {
  mission::Mission mission;
  planning::World world;
  vehicle::Model model;
};

/// Throws if it cannot be read.
[[nodiscard]] inline StudySetup load_setup(const std::string& path) {
  Diagnostics diagnostics;
  auto mission = mission::load_mission(path, diagnostics);
  if (!mission) throw std::runtime_error(path + " cannot be read");
  auto world = planning::load_sdf(mission->map_path, diagnostics);
  auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  if (!world || !model) throw std::runtime_error(path + ": no world");
  return {std::move(*mission), std::move(*world), std::move(*model)};
}

/// Loads missions/NAME.xml.
[[nodiscard]] inline StudySetup load_shipped_setup(const std::string& name) {
  return load_setup(DIVE_SOURCE_DIR "/missions/" + name + ".xml");
}

}  // namespace dive::bench
