#include "bench/real_waters.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "common/source_text.h"

namespace dive::bench {
namespace {

namespace fs = std::filesystem;

/// The mission into our wreck without a map, moved to another environment.
struct Water {
  const char* name;
  const char* mesh;  ///< Path below the shared data.
  const char* X_WM;  ///< SDF: x y z roll pitch yaw.
  /// Limits that replace the wreck's; the members below likewise replace the wreck's.
  const char* limits;
  const char* start;
  const char* first_goal;
  const char* second_goal;
};

constexpr Water kWaters[] = {
    {"hull", "meshes/wreck_sunkenship/sunkenship_distort.dae", "0 0 -20 0 0 0",
     R"(max_depth="25" min_altitude="0")",
     R"(x="-14" y="6" z="14" z_units="DEPTH" heading_deg="180")", R"(x="0.8" y="-0.1" z="19.9")",
     R"(x="2.8" y="-0.1" z="17.9")"},
    {"cave", "meshes/caves_ltu/cave_tile_1.obj", "0 0 -12 1.5707963 0 0",
     R"(max_depth="11.7" min_altitude="0.2")",
     R"(x="0" y="-13" z="9.8" z_units="DEPTH" heading_deg="0")", R"(x="0" y="-8" z="9.8")",
     R"(x="0" y="8" z="9.8")"},
    {"dock", "meshes/vortex/docking_station.obj", "6 0 -8 1.5707963 0 0",
     R"(max_depth="12" min_altitude="0")", R"(x="0" y="0" z="7" z_units="DEPTH" heading_deg="90")",
     R"(x="6" y="0" z="7.2")", R"(x="10" y="0" z="8")"}};

std::string mission_for(const Water& water) {
  const auto source = read_source_text(DIVE_SOURCE_DIR "/missions/wreck_unknown.xml", 1U << 20U);
  if (!source) throw std::runtime_error("missions/wreck_unknown.xml: " + source.error());
  std::string text = source->content();
  const std::pair<const char*, std::string> changes[] = {
      {"maps/wreck.sdf", fmt::format("{}.sdf", water.name)},
      {R"(max_depth="14.8" min_altitude="0.2")", water.limits},
      {R"(x="2" y="9" z="12" z_units="DEPTH" heading_deg="180")", water.start},
      {R"(x="0" y="0" z="13.2")", water.first_goal},
      {R"(x="-8.5" y="1.2" z="12.8")", water.second_goal}};
  for (const auto& [from, to] : changes) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos)
      throw std::runtime_error(fmt::format("no {} in the mission", from));
    text.replace(at, std::string(from).size(), to);
  }
  return text;
}

}  // namespace

std::vector<std::string> write_real_waters(const std::string& data) {
  std::string folder = (fs::temp_directory_path() / "real-waters-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no temporary folder");
  std::vector<std::string> missions;
  for (const Water& water : kWaters) {
    const fs::path mesh = fs::path(data) / water.mesh;
    if (!fs::exists(mesh)) throw std::runtime_error(mesh.string() + " is not there");
    const fs::path stem = fs::path(folder) / water.name;
    const std::string copy = water.name + mesh.extension().string();
    fs::copy_file(mesh, fs::path(folder) / copy);
    std::ofstream(stem.string() + ".sdf") << fmt::format(
        "<sdf version='1.6'><model name='{}'><static>true</static><pose>{}</pose>"
        "<link name='link'><collision name='mesh'><geometry><mesh><uri>{}</uri>"
        "</mesh></geometry></collision></link></model></sdf>",
        water.name, water.X_WM, copy);
    missions.push_back(stem.string() + ".xml");
    std::ofstream(missions.back()) << mission_for(water);
  }
  return missions;
}

}  // namespace dive::bench
