#include "mission/cli/loading.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/assert.h"
#include "common/input_file.h"
#include "common/mathematics.h"
#include "common/suggest.h"
#include "common/xml.h"
#include "mission/cli/file_kind.h"
#include "mission/cli/terminal.h"
#include "mission/diff/plan_difference.h"
#include "mission/document/map_file.h"
#include "planning/world/sdf.h"
#include "vehicle/simulator/water/named_waters.h"

namespace dive::mission {
namespace {

std::optional<Fault> parse_fault(const std::string& written) {
  const std::size_t at = written.find('@');
  const std::optional<FaultKind> kind = find_fault(written.substr(0, at));
  if (!kind) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < kFaultCount; ++i) {
      names.emplace_back(to_string(static_cast<FaultKind>(i)));
    }
    complain(fmt::format("there is no fault '{}'; there are {}", written.substr(0, at),
                         fmt::join(names, ", ")));
    return std::nullopt;
  }
  const std::optional<double> seconds =
      at == std::string::npos ? std::nullopt : parse_number(written.substr(at + 1));
  if (!seconds || *seconds < 0.0) {
    complain(fmt::format("'{}' does not say when: write {}@SECONDS", written, to_string(*kind)));
    return std::nullopt;
  }
  return Fault{*kind, *seconds};
}

}  // namespace

vehicle::Model load_vehicle() {
  Diagnostics diagnostics;
  std::optional<vehicle::Model> model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  DIVE_DEMAND(model.has_value());
  return std::move(*model);
}

std::optional<LoadedVehicle> load_vehicle(const std::string& path, Diagnostics& diagnostics) {
  SourceText urdf = vehicle::aqua2_urdf();
  if (!path.empty()) {
    std::optional<XmlDocument> document = read_xml(path, XmlLimits{}, diagnostics);
    if (!document) return std::nullopt;
    urdf = std::move(document->source);
  }
  std::optional<vehicle::Model> model = vehicle::parse_urdf(urdf, diagnostics);
  if (!model) return std::nullopt;
  if (!model->hips_B.allFinite()) {
    diagnostics.error(
        "URDF-HIPS", urdf, urdf.span_at(0, 1),
        fmt::format("the vehicle '{}' has no flippers: dive steers vehicles with six flippers only",
                    model->name),
        "name its six hips left_front, left_mid, left_rear, right_front, ...");
    return std::nullopt;
  }
  return LoadedVehicle{std::move(urdf), std::move(*model)};
}

namespace {

struct WorldFile {
  SourceText text;
  std::string meshes;  // for the log
  planning::World world;
};

// The world in the file that the mission names at `name`.
std::optional<WorldFile> read_world(const Mission& mission, const std::string& path,
                                    const Located<std::string>& name, planning::Resources resources,
                                    Diagnostics& diagnostics) {
  tl::expected<SourceText, std::string> text = planning::read_map_text(path);
  if (!text) {
    diagnostics.error("MIS-MAP-NOT-FOUND", mission.source, name.span,
                      fmt::format("the map cannot be read: {}", text.error()));
    return std::nullopt;
  }
  planning::MeshFiles meshes(path, resources,
                             [](const std::string& what) { note("dive: " + what); });
  std::optional<planning::World> world = planning::parse_sdf(*text, diagnostics, meshes);
  if (!world) return std::nullopt;
  const std::size_t errors_before = diagnostics.error_count();
  check_map_origin(mission, *text, diagnostics);
  if (diagnostics.error_count() != errors_before) return std::nullopt;
  return WorldFile{std::move(*text), meshes.bundle(), std::move(*world)};
}

// Reads what the mission names.
std::optional<LoadedMission> with_map(std::optional<Mission> mission,
                                      std::optional<LoadedVehicle> described,
                                      planning::Resources resources, Diagnostics& diagnostics) {
  if (!mission || !described) return std::nullopt;
  LoadedMission loaded;
  loaded.mission = std::move(*mission);
  loaded.model = std::move(described->model);
  loaded.vehicle = std::move(described->urdf);
  if (!has_simulation_map(loaded.mission)) return loaded;
  std::optional<WorldFile> map = read_world(loaded.mission, loaded.mission.map_path,
                                            loaded.mission.map_file, resources, diagnostics);
  if (!map) return std::nullopt;
  loaded.map = std::move(map->text);
  loaded.map_meshes = std::move(map->meshes);
  loaded.world = std::move(map->world);
  const std::string& simulated = loaded.mission.simulation_map_path;
  if (simulated.empty()) return loaded;
  std::optional<WorldFile> other =
      read_world(loaded.mission, simulated, *loaded.mission.simulation_map, resources, diagnostics);
  if (!other) return std::nullopt;
  loaded.simulation_map = std::move(other->text);
  loaded.simulated_world = std::move(other->world);
  return loaded;
}

}  // namespace

std::optional<LoadedMission> load(const std::string& path, planning::Resources resources,
                                  Diagnostics& diagnostics, const std::string& vehicle) {
  if (!is_text_of(FileKind::kMission, path, diagnostics)) return std::nullopt;
  std::optional<LoadedVehicle> described = load_vehicle(vehicle, diagnostics);
  return with_map(load_mission(path, diagnostics), std::move(described), resources, diagnostics);
}

std::optional<LoadedMission> load(SourceText mission, planning::Resources resources,
                                  Diagnostics& diagnostics) {
  std::optional<LoadedVehicle> described = load_vehicle("", diagnostics);
  return with_map(parse_mission(std::move(mission), diagnostics), std::move(described), resources,
                  diagnostics);
}

std::optional<LogReader> open_log(const std::string& path) {
  if (kind_of_file(path) == FileKind::kBundle) {
    complain(fmt::format("{}: this is a verified bundle, not a log", path));
    return std::nullopt;
  }
  tl::expected<LogReader, std::string> log = LogReader::open(path);
  if (log) return std::move(*log);
  complain(log.error());
  return std::nullopt;
}

LogHeader header_of(const LoadedMission& loaded, std::uint64_t seed) {
  LogHeader header;
  header.version = DIVE_VERSION;
  header.mathematics = mathematics();
  header.seed = seed;
  header.mission_name = std::filesystem::path(loaded.mission.source.path()).filename().string();
  header.mission_xml = loaded.mission.source.content();
  header.map_name = loaded.mission.map_file.value;
  header.map_xml = loaded.map.content();
  header.map_meshes = loaded.map_meshes;
  header.vehicle_urdf = loaded.vehicle.content();
  header.check = loaded.check;
  return header;
}

std::optional<vehicle::Conditions> parse_conditions(const std::vector<std::string>& settings,
                                                    vehicle::Conditions conditions) {
  std::vector<std::string> names;
  for (const auto& [name, value] : conditions.list()) names.push_back(name);
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    const std::string name = setting.substr(0, equals);
    const std::optional<double> value =
        equals == std::string::npos ? std::nullopt : parse_number(setting.substr(equals + 1));
    if (!value) {
      complain(fmt::format("--set {}: expected NAME=NUMBER", setting));
      return std::nullopt;
    }
    if (!conditions.set(name, *value)) {
      const std::optional<std::string> meant = closest_match(name, names);
      complain(fmt::format("--set {}: there is no condition '{}'{}; there are: {}", setting, name,
                           meant ? fmt::format(" (did you mean '{}'?)", *meant) : "",
                           fmt::join(names, ", ")));
      return std::nullopt;
    }
  }
  if (const std::string problem = conditions.validate(); !problem.empty()) {
    complain("--set: " + problem);
    return std::nullopt;
  }
  return conditions;
}

std::optional<vehicle::StereoCameraOptions> parse_water(const std::string& name) {
  const std::optional<vehicle::StereoCameraOptions> cameras = vehicle::stereo_camera_in(name);
  if (cameras) return cameras;
  const std::vector<std::string>& names = vehicle::water_names();
  const std::string hint = did_you_mean(name, names);
  complain(fmt::format("--simulated-water {}: must be one of {}{}", name, fmt::join(names, ", "),
                       hint.empty() ? "" : "; " + hint));
  return std::nullopt;
}

std::optional<WrittenPose> parse_pose(const char* option, std::string text) {
  for (char& c : text) {
    if (c == ',') c = ' ';
  }
  WrittenPose result;
  if (const auto position = parse_numbers(text, 3)) {
    result.pose.p = {(*position)[0], (*position)[1], (*position)[2]};
    return result;
  }
  if (const auto all = parse_numbers(text, 6)) {
    const std::vector<double>& v = *all;
    result.pose = {{v[0], v[1], v[2]},
                   from_rpy(deg_to_rad(v[3]), deg_to_rad(v[4]), deg_to_rad(v[5]))};
    result.has_attitude = true;
    return result;
  }
  complain(
      fmt::format("{} {}: expected x,y,z or x,y,z,roll,pitch,yaw_deg (metres, z up and "
                  "negative under water, degrees)",
                  option, text));
  return std::nullopt;
}

std::optional<vehicle::DiverTrack> parse_diver(const std::string& written) {
  vehicle::DiverTrack track;
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= written.size();) {
    const std::size_t end = std::min(written.find(':', begin), written.size());
    parts.push_back(written.substr(begin, end - begin));
    begin = end + 1;
  }
  const std::optional<double> start = parse_number(parts.front());
  for (std::size_t i = 1; i < parts.size(); ++i) {
    std::replace(parts[i].begin(), parts[i].end(), ',', ' ');
    const auto p = parse_numbers(parts[i], 3);
    if (p) track.waypoints.push_back({{(*p)[0], (*p)[1], (*p)[2]}, 0.0});
  }
  track.start_s = start.value_or(-1.0);
  const bool is_whole = start && track.waypoints.size() + 1 == parts.size();
  const std::string problem = is_whole ? track.validate() : "";
  if (is_whole && problem.empty()) return track;
  complain(fmt::format("--diver {}: expected SECONDS:X,Y,Z[:X,Y,Z...]{}{}", written,
                       problem.empty() ? "" : "; ", problem));
  return std::nullopt;
}

std::optional<nlohmann::ordered_json> read_plan(const std::string& path) {
  constexpr std::size_t kMaxBytes = 64U << 20U;
  const tl::expected<SourceText, std::string> text = read_source_text(path, kMaxBytes);
  auto plan = text ? parse_plan(text->content()) : tl::unexpected(text.error());
  if (plan) return std::optional<nlohmann::ordered_json>(std::move(*plan));
  complain(fmt::format("{}: {}", path, plan.error()));
  return std::nullopt;
}

std::optional<std::vector<Fault>> parse_faults(const std::vector<std::string>& written) {
  std::vector<Fault> faults;
  for (const std::string& one : written) {
    const std::optional<Fault> fault = parse_fault(one);
    if (!fault) return std::nullopt;
    faults.push_back(*fault);
  }
  return faults;
}

}  // namespace dive::mission
