#include "mission/document/map_file.h"

#include <filesystem>

#include "mission/document/file_beneath.h"

namespace dive::mission {

void resolve_map(Mission& mission, Diagnostics& diagnostics) {
  if (mission.map_file.value.empty()) return;
  const std::filesystem::path folder =
      std::filesystem::absolute(mission.source.path()).parent_path();
  const auto path = file_beneath(folder, folder, mission.map_file.value, "map");
  if (path) {
    mission.map_path = path->string();
    return;
  }
  diagnostics.error(path.error().is_outside ? "MIS-MAP-OUTSIDE" : "MIS-MAP-NOT-FOUND",
                    mission.source, mission.map_file.span, path.error().reason, path.error().hint);
}

}  // namespace dive::mission
