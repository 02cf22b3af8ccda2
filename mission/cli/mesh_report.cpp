#include "mission/cli/mesh_report.h"

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/terminal.h"
#include "planning/world/mesh_facts.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;

std::string volume_text(const planning::MeshFacts& facts) {
  if (!facts.volume_m3) return "open: no volume";
  return fmt::format("{:.4g} m3{}", std::abs(*facts.volume_m3),
                     *facts.volume_m3 < 0.0 ? " (its triangles face inwards)" : "");
}

}  // namespace

Json meshes_json(const planning::World& world) {
  Json meshes = Json::array();
  for (const planning::Surface& surface : world.surfaces) {
    const planning::MeshFacts facts = planning::facts_of(surface.mesh);
    const Eigen::Vector3d size = facts.bounds.sizes();
    meshes.push_back({{"name", surface.name},
                      {"file", surface.file},
                      {"triangles", surface.mesh.triangles.size()},
                      {"extent_m", {size.x(), size.y(), size.z()}},
                      {"top_z_m", facts.bounds.max().z()},
                      {"bottom_z_m", facts.bounds.min().z()},
                      {"volume_m3", facts.volume_m3 ? Json(*facts.volume_m3) : Json(nullptr)},
                      {"closed", facts.is_closed}});
  }
  return meshes;
}

void print_meshes(const planning::World& world) {
  for (const planning::Surface& surface : world.surfaces) {
    const planning::MeshFacts facts = planning::facts_of(surface.mesh);
    const Eigen::Vector3d size = facts.bounds.sizes();
    print(
        fmt::format("  mesh   {}: {} triangles, {:.2f} x {:.2f} x {:.2f} m, z from {:.2f} to "
                    "{:.2f} m, {}",
                    surface.name, surface.mesh.triangles.size(), size.x(), size.y(), size.z(),
                    facts.bounds.min().z(), facts.bounds.max().z(), volume_text(facts)));
  }
}

}  // namespace dive::mission
