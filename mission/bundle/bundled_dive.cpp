#include "mission/bundle/bundled_dive.h"

#include <utility>

#include <fmt/format.h>

#include "mission/record/replay.h"
#include "planning/world/sdf.h"

namespace dive::mission {

tl::expected<BundledDive, std::string> bundled_dive(const Bundle& bundle) {
  BundledMeshes meshes(bundle.header.map_meshes, false, bundle.meshes);
  tl::expected<LoggedDive, std::string> dive = logged_dive(bundle.header, meshes);
  if (!dive) return tl::unexpected(dive.error());
  BundledDive result{std::move(dive->mission), std::move(dive->map), std::nullopt,
                     std::move(dive->model)};
  if (bundle.simulation_xml.empty()) return result;
  Diagnostics diagnostics;
  BundledMeshes simulated(bundle.simulation_meshes, true, bundle.meshes);
  result.simulated_world = planning::parse_sdf(
      SourceText(bundle.simulation_name, bundle.simulation_xml), diagnostics, simulated);
  if (result.simulated_world) return result;
  return tl::unexpected(
      fmt::format("its simulated world is not accepted: {}", diagnostics.list().front().message));
}

}  // namespace dive::mission
