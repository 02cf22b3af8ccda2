#include "mission/document/map_file.h"

#include <filesystem>

#include "mission/document/file_beneath.h"

namespace dive::mission {
namespace {

std::string resolve(const Located<std::string>& file, const Mission& mission,
                    Diagnostics& diagnostics) {
  const std::filesystem::path folder =
      std::filesystem::absolute(mission.source.path()).parent_path();
  const auto path = file_beneath(folder, folder, file.value, "map");
  if (path) return path->string();
  diagnostics.error(path.error().is_outside ? "MIS-MAP-OUTSIDE" : "MIS-MAP-NOT-FOUND",
                    mission.source, file.span, path.error().reason, path.error().hint);
  return {};
}

}  // namespace

void resolve_maps(Mission& mission, Diagnostics& diagnostics) {
  if (!mission.map_file.value.empty()) {
    mission.map_path = resolve(mission.map_file, mission, diagnostics);
  }
  if (mission.simulation_map) {
    mission.simulation_map_path = resolve(*mission.simulation_map, mission, diagnostics);
  }
}

}  // namespace dive::mission
