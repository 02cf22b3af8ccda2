#include "mission/document/map_file.h"

#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "mission/document/file_beneath.h"
#include "planning/world/sdf.h"

namespace dive::mission {
namespace {

constexpr double kSameOrigin = 0.01;  // m

std::string resolve(const Located<std::string>& file, const Mission& mission,
                    Diagnostics& diagnostics) {
  if (mission.source.path().empty()) {  // an editor's text
    diagnostics.error("MIS-MAP-NOT-FOUND", mission.source, file.span,
                      fmt::format("the map '{}' cannot be found: the mission has no file yet, and "
                                  "maps are named from its folder",
                                  file.value),
                      "save the mission to a file");
    return {};
  }
  std::error_code error;
  const std::filesystem::path folder =
      std::filesystem::absolute(mission.source.path(), error).parent_path();
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

void check_map_origin(const Mission& mission, const SourceText& map, Diagnostics& diagnostics) {
  const std::optional<GeoPoint> stated = planning::sdf_origin(map, diagnostics);
  if (!stated || !mission.origin) return;
  const auto offset = to_plane(mission.origin->place, *stated);
  if (offset && offset->norm() <= kSameOrigin) return;
  diagnostics.error(
      "MIS-MAP-ORIGIN", mission.source, mission.origin->span,
      fmt::format("the map {} has its origin at latitude {}, longitude {}, {} from that of the "
                  "mission",
                  std::filesystem::path(map.path()).filename().string(), stated->latitude_deg,
                  stated->longitude_deg,
                  offset ? fmt::format("{:.2f} m", offset->norm()) : "more than 20 km"),
      "x and y of map and mission must mean the same places: correct the origin that is wrong");
}

}  // namespace dive::mission
