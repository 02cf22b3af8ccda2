#include "mission/cli/bundle_file.h"

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/clock.h"
#include "mission/bundle/bundle.h"
#include "mission/bundle/bundled_dive.h"
#include "mission/bundle/plan_proof.h"
#include "mission/bundle/vehicle_difference.h"
#include "mission/cli/file_kind.h"
#include "mission/cli/json.h"
#include "mission/cli/terminal.h"
#include "planning/world/scene.h"
#include "planning/world/sdf.h"

namespace dive::mission {
namespace {

constexpr const char* kCheckAgain = "check the mission again: dive check MISSION --bundle FILE";

std::string verdict_of(const CheckArguments& arguments, const CheckReport& report,
                       const Diagnostics& diagnostics) {
  nlohmann::ordered_json json = to_json(report, diagnostics);
  json["seed"] = arguments.seed;
  json["conditions"] = arguments.conditions;
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Adds the triangles of a map's meshes. Returns the text of their pieces.
std::string keep_meshes(const std::string& path, const SourceText& map, bool is_simulation,
                        planning::Resources resources, Bundle& bundle) {
  planning::MeshFiles files(path, resources);
  MeshKeeper keeper(files, is_simulation, bundle.meshes);
  Diagnostics reported_when_loaded;
  const auto world = planning::parse_sdf(map, reported_when_loaded, keeper);
  return world ? files.bundle() : std::string();
}

std::vector<BundledLeg> legs_of(const LoadedMission& loaded, const CheckReport& report,
                                std::uint64_t seed) {
  const planning::Scene scene(loaded.world);
  const Route route = nominal_route(loaded.mission, scene);
  RouteRequests requests(route, seed);
  std::vector<BundledLeg> legs;
  for (const PlannedRouteLeg& leg : report.legs) {
    legs.push_back({leg.state, leg.goal, requests.next(), leg.plan});
    requests.arrive(leg.plan.waypoints);
  }
  return legs;
}

/// The error is a sentence.
tl::expected<Bundle, std::string> make_bundle(const CheckArguments& arguments,
                                              const LoadedMission& loaded,
                                              const CheckReport& report,
                                              const Diagnostics& diagnostics) {
  Bundle bundle;
  bundle.header = header_of(loaded, arguments.seed);
  bundle.verdict = verdict_of(arguments, report, diagnostics);
  bundle.legs = legs_of(loaded, report, arguments.seed);
  const planning::Resources where = resources(arguments.allow_outside);
  const Mission& mission = loaded.mission;
  if (!loaded.map_meshes.empty() &&
      keep_meshes(mission.map_path, loaded.map, false, where, bundle) != loaded.map_meshes) {
    return tl::unexpected(std::string("a mesh of the map was changed during the check"));
  }
  if (!loaded.simulated_world) return bundle;
  bundle.simulation_name = mission.simulation_map->value;
  bundle.simulation_xml = loaded.simulation_map.content();
  bundle.simulation_meshes =
      keep_meshes(mission.simulation_map_path, loaded.simulation_map, true, where, bundle);
  return bundle;
}

void refuse(const std::string& path, const char* code, std::string why, std::string hint,
            Diagnostics& diagnostics) {
  Diagnostic diagnostic;
  diagnostic.code = code;
  diagnostic.file = path;
  diagnostic.message = std::move(why);
  diagnostic.hint = std::move(hint);
  diagnostics.add(std::move(diagnostic));
}

// Both report an error and return nothing if the bundle is not accepted.

std::optional<OpenedBundle> open_bundle(const std::string& path,
                                        const std::optional<link::Key>& key,
                                        Diagnostics& diagnostics) {
  tl::expected<OpenedBundle, std::string> opened = read_bundle(path, key);
  if (opened) return std::move(*opened);
  refuse(path, "BUNDLE-DAMAGED", opened.error(),
         fmt::format("{}{}", kCheckAgain, key ? " --key KEY" : ""), diagnostics);
  return std::nullopt;
}

std::optional<BundledDive> dive_of(const OpenedBundle& opened, const std::string& path,
                                   Diagnostics& diagnostics) {
  tl::expected<BundledDive, std::string> dive = bundled_dive(opened.bundle);
  if (dive) return std::move(*dive);
  refuse(path, "BUNDLE-CONTENT", dive.error(), kCheckAgain, diagnostics);
  return std::nullopt;
}

/// True if vehicle and plans are those of the check; else reports why not.
bool is_verified(const RunArguments& arguments, const OpenedBundle& opened, const BundledDive& dive,
                 const vehicle::Model& here, Diagnostics& diagnostics) {
  SteadyClock clock;
  const Utime begun = clock.now();
  if (const std::string difference = vehicle_difference(dive.model, here); !difference.empty()) {
    refuse(arguments.mission, "BUNDLE-VEHICLE", "the bundle was made for " + difference,
           "give the description that it was checked with (--vehicle FILE), or check the mission "
           "again for this vehicle",
           diagnostics);
    return false;
  }
  const tl::expected<PlanProof, std::string> proof =
      prove_plans(opened.bundle.legs, dive.mission, dive.world, here.hull);
  if (!proof) {
    refuse(arguments.mission, "BUNDLE-PLAN", proof.error(), kCheckAgain, diagnostics);
    return false;
  }
  const double took_ms = 1e3 * to_seconds(clock.now() - begun);
  note(fmt::format("dive: {}: verified: {} plan(s) certified again in {:.0f} ms, made by dive {}{}",
                   arguments.mission, proof->legs, took_ms, opened.bundle.header.version,
                   opened.is_authentic ? ", code made with this key" : ""));
  if (opened.has_code && !opened.is_authentic) {
    note(fmt::format("dive: {}: it has a code, which only --key can verify", arguments.mission));
  }
  return true;
}

LoadedMission loaded_of(BundledDive dive, OpenedBundle opened, const RunArguments& arguments,
                        LoadedVehicle here) {
  Bundle& bundle = opened.bundle;
  LoadedMission loaded;
  loaded.mission = std::move(dive.mission);
  loaded.map = SourceText(bundle.header.map_name, std::move(bundle.header.map_xml));
  loaded.map_meshes = std::move(bundle.header.map_meshes);
  loaded.world = std::move(dive.world);
  loaded.simulated_world = std::move(dive.simulated_world);
  loaded.model = std::move(here.model);
  loaded.vehicle = std::move(here.urdf);
  loaded.check = fmt::format("bundle {}{}", opened.hash, arguments.unchecked ? ", unchecked" : "");
  return loaded;
}

std::optional<LoadedMission> load_bundle(const RunArguments& arguments,
                                         const std::optional<link::Key>& key,
                                         Diagnostics& diagnostics) {
  std::optional<OpenedBundle> opened = open_bundle(arguments.mission, key, diagnostics);
  if (!opened) return std::nullopt;
  std::optional<LoadedVehicle> here = load_vehicle(arguments.vehicle, diagnostics);
  if (!here) return std::nullopt;
  std::optional<BundledDive> dive = dive_of(*opened, arguments.mission, diagnostics);
  if (!dive) return std::nullopt;
  if (!arguments.unchecked && !is_verified(arguments, *opened, *dive, here->model, diagnostics)) {
    return std::nullopt;
  }
  return loaded_of(std::move(*dive), std::move(*opened), arguments, std::move(*here));
}

}  // namespace

tl::expected<std::optional<link::Key>, int> key_of(const std::string& path) {
  if (path.empty()) return std::nullopt;
  tl::expected<link::Key, std::string> key = link::read_key(path);
  if (key) return std::optional<link::Key>(*key);
  complain(key.error());
  return tl::unexpected<int>(kExitUsage);
}

int write_bundle(Result& file, const CheckArguments& arguments, const std::optional<link::Key>& key,
                 const LoadedMission& loaded, const CheckReport& report,
                 const Diagnostics& diagnostics) {
  if (!file) return kExitSuccess;
  if (!diagnostics.ok()) {
    note(fmt::format("dive: {}: no bundle is written, because the mission is not ready to dive",
                     arguments.bundle));
    return kExitSuccess;
  }
  const tl::expected<std::vector<std::uint8_t>, std::string> bytes =
      make_bundle(arguments, loaded, report, diagnostics).and_then([&](const Bundle& bundle) {
        return pack_bundle(bundle, key);
      });
  if (!bytes) {
    complain(fmt::format("{}: {}", arguments.bundle, bytes.error()));
    return kExitUsage;
  }
  return write_result(file, {reinterpret_cast<const char*>(bytes->data()), bytes->size()});
}

std::optional<LoadedMission> load_dive(const RunArguments& arguments,
                                       const std::optional<link::Key>& key,
                                       Diagnostics& diagnostics) {
  if (kind_of_file(arguments.mission) == FileKind::kBundle) {
    return load_bundle(arguments, key, diagnostics);
  }
  std::optional<LoadedMission> loaded =
      load(arguments.mission, resources(arguments.allow_outside), diagnostics, arguments.vehicle);
  if (loaded && arguments.unchecked) loaded->check = "unchecked";
  if (loaded && loaded->check.empty() && !arguments.link.url.empty()) {
    note(
        fmt::format("dive: {}: not a verified bundle: nothing shows that mission, maps and vehicle "
                    "are those that were checked; make one with dive check --bundle FILE, or give "
                    "--unchecked",
                    arguments.mission));
  }
  return loaded;
}

std::optional<SupervisedDive> load_supervised(const SuperviseArguments& arguments,
                                              const std::optional<link::Key>& key,
                                              Diagnostics& diagnostics) {
  const std::string& path = arguments.mission;
  if (kind_of_file(path) != FileKind::kBundle) {
    std::optional<LoadedMission> loaded =
        load(path, resources(arguments.allow_outside), diagnostics, arguments.vehicle);
    if (!loaded) return std::nullopt;
    return SupervisedDive{std::move(loaded->mission), std::move(loaded->world),
                          loaded->model.motion};
  }
  const std::optional<OpenedBundle> opened = open_bundle(path, key, diagnostics);
  if (!opened) return std::nullopt;
  std::optional<BundledDive> dive = dive_of(*opened, path, diagnostics);
  if (!dive) return std::nullopt;
  MotionModel motion = dive->model.motion;
  if (!arguments.vehicle.empty()) {
    const std::optional<LoadedVehicle> here = load_vehicle(arguments.vehicle, diagnostics);
    if (!here) return std::nullopt;
    motion = here->model.motion;
  }
  return SupervisedDive{std::move(dive->mission), std::move(dive->world), motion};
}

std::optional<Mission> load_mission_or_bundle(const std::string& path, Diagnostics& diagnostics) {
  if (kind_of_file(path) != FileKind::kBundle) {
    if (!is_text_of(FileKind::kMission, path, diagnostics)) return std::nullopt;
    return load_mission(path, diagnostics);
  }
  const std::optional<OpenedBundle> opened = open_bundle(path, std::nullopt, diagnostics);
  if (!opened) return std::nullopt;
  std::optional<BundledDive> dive = dive_of(*opened, path, diagnostics);
  if (!dive) return std::nullopt;
  return std::move(dive->mission);
}

}  // namespace dive::mission
