#pragma once
// Loading what a command works on.

#include <optional>
#include <string>
#include <vector>

#include "common/diagnostic.h"
#include "mission/check/faults.h"
#include "mission/document/mission.h"
#include "mission/record/log.h"
#include "planning/world/world.h"
#include "vehicle/model.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/simulator.h"
#include "vehicle/simulator/stereo_camera.h"

namespace dive::mission {

struct LoadedMission {
  Mission mission;
  SourceText map;          ///< In unknown water: of the rehearsal, empty where there is none.
  std::string map_meshes;  ///< For the log.
  planning::World world;   ///< What is there; see known_world() for what the vehicle knows of it.
  vehicle::Model model;
};

/// The mission and its map; every mistake is a diagnostic.
[[nodiscard]] std::optional<LoadedMission> load(const std::string& path, Diagnostics& diagnostics);

/// What a log of a dive of it begins with.
[[nodiscard]] LogHeader header_of(const LoadedMission& loaded, std::uint64_t seed);

/// The vehicle that is compiled in. Demands that it can be read.
[[nodiscard]] vehicle::Model load_vehicle();

/// Pool conditions with NAME=VALUE settings applied; a complaint and nothing when one is wrong.
[[nodiscard]] std::optional<vehicle::Conditions> parse_conditions(
    const std::vector<std::string>& settings);

/// "x,y,z[,roll,pitch,yaw_deg]" in W, metres and degrees.
struct WrittenPose {
  Pose pose;
  bool has_attitude = false;
};

/// "SECONDS:X,Y,Z:X,Y,Z...": someone who swims from place to place from then on; complains.
[[nodiscard]] std::optional<vehicle::DiverTrack> parse_diver(const std::string& written);

/// The cameras in the water of that name; complains when there is no such water.
[[nodiscard]] std::optional<vehicle::StereoCameraOptions> parse_water(const std::string& name);

/// Complains when `text`, given with `option`, is no pose.
[[nodiscard]] std::optional<WrittenPose> parse_pose(const char* option, std::string text);

/// Faults from "NAME@SECONDS"; complains when one is none.
[[nodiscard]] std::optional<std::vector<Fault>> parse_faults(
    const std::vector<std::string>& written);

}  // namespace dive::mission
