#pragma once
// The dives of a study: a mission with its route, and what each seed draws beside it.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "bench/study_setup.h"
#include "common/se3.h"
#include "mission/simulation/simulated_dive.h"
#include "planning/world/world.h"

namespace dive::bench {

struct Draw {
  std::vector<std::string> conditions;  ///< NAME=VALUE, applied to those of the mission.
  std::string world;  ///< File of a world that the vehicle has no map of; empty: that of the map.
  bool with_diver = false;
  int unmapped = 0;                         ///< Number of objects on the route that the map lacks.
  std::optional<mission::FaultKind> fault;  ///< At a drawn time on the route, for good.
  std::string until;  ///< State in which errors of the position no longer count; empty: none.
};

struct RoutedSetup : StudySetup {
  vehicle::Conditions conditions;
  std::optional<planning::World> other_world;  ///< If it is not that of the map.
  std::vector<Pose> route;                     ///< Route of a vehicle that knows the whole world.
  std::vector<Eigen::Vector3d> stops;          ///< Start and goals of its legs.
};
/// Throws if the mission, its world, a condition or a leg's plan cannot be had.
[[nodiscard]] RoutedSetup load_routed(const std::string& path, const Draw& draw);

[[nodiscard]] mission::DiveSettings settings_for(const RoutedSetup& setup, const Draw& draw,
                                                 std::uint64_t seed);

}  // namespace dive::bench
