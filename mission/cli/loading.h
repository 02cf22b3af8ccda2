#pragma once
// Loads the inputs of a command.

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "common/diagnostic.h"
#include "mission/document/mission.h"
#include "mission/record/log.h"
#include "mission/simulation/faults.h"
#include "planning/world/mesh_source.h"
#include "planning/world/world.h"
#include "vehicle/model.h"
#include "vehicle/simulator/cameras/stereo_camera.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

struct LoadedMission {
  Mission mission;
  SourceText map;          ///< Unknown environment: the simulated world, empty without one.
  std::string map_meshes;  ///< Meshes for the log.
  planning::World world;   ///< The map; known_world() is the part available to the vehicle.
  std::optional<planning::World> simulated_world;  ///< If it is not the map.
  vehicle::Model model;
  SourceText vehicle;         ///< The description of the model.
  SourceText simulation_map;  ///< The simulated world, if it is not the map.
  std::string check;          ///< LogHeader::check.
};

struct LoadedVehicle {
  SourceText urdf;
  vehicle::Model model;
};

/// The meaning of `--allow-outside`.
[[nodiscard]] inline planning::Resources resources(bool allow_outside) {
  return allow_outside ? planning::Resources::kAnywhere : planning::Resources::kInFolder;
}

/// The mission, its map and the vehicle of the description `vehicle` (empty: the compiled-in one);
/// reports every mistake as a diagnostic.
[[nodiscard]] std::optional<LoadedMission> load(const std::string& path,
                                                planning::Resources resources,
                                                Diagnostics& diagnostics,
                                                const std::string& vehicle = {});

/// The vehicle of a description, which must be one that can be dived; `path` empty: the compiled-in
/// one.
[[nodiscard]] std::optional<LoadedVehicle> load_vehicle(const std::string& path,
                                                        Diagnostics& diagnostics);

/// The same for a mission in memory, with the compiled-in vehicle; `mission.path()` determines the
/// folder of its files.
[[nodiscard]] std::optional<LoadedMission> load(SourceText mission, planning::Resources resources,
                                                Diagnostics& diagnostics);

/// The plan in a file of JSON, as parse_plan() gives it; complains if there is none.
[[nodiscard]] std::optional<nlohmann::ordered_json> read_plan(const std::string& path);

/// The header of the log of a dive of that mission.
[[nodiscard]] LogHeader header_of(const LoadedMission& loaded, std::uint64_t seed);

/// Opens a log; prints an error if it cannot be read, or is a bundle, whose records look like those
/// of a log.
[[nodiscard]] std::optional<LogReader> open_log(const std::string& path);

/// The compiled-in vehicle. Requires that it can be read.
[[nodiscard]] vehicle::Model load_vehicle();

/// `conditions` with NAME=VALUE settings applied; prints an error and returns nothing if one is
/// invalid.
[[nodiscard]] std::optional<vehicle::Conditions> parse_conditions(
    const std::vector<std::string>& settings, vehicle::Conditions conditions);

/// "x,y,z[,roll,pitch,yaw_deg]" in W, metres and degrees.
struct WrittenPose {
  Pose pose;
  bool has_attitude = false;
};

/// A diver who swims between the given positions from the given time: "SECONDS:X,Y,Z[:X,Y,Z...]";
/// prints an error if invalid.
[[nodiscard]] std::optional<vehicle::DiverTrack> parse_diver(const std::string& written);

/// The cameras in water of the named type; prints an error if there is no such type.
[[nodiscard]] std::optional<vehicle::StereoCameraOptions> parse_water(const std::string& name);

/// Prints an error if `text`, the value of `option`, is not a pose.
[[nodiscard]] std::optional<WrittenPose> parse_pose(const char* option, std::string text);

/// Faults from "NAME@SECONDS"; prints an error if one is invalid.
[[nodiscard]] std::optional<std::vector<Fault>> parse_faults(
    const std::vector<std::string>& written);

}  // namespace dive::mission
