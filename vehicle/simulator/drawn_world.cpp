#include "vehicle/simulator/drawn_world.h"

#include <map>
#include <string>

#include "vehicle/simulator/horizontal_draw.h"

namespace dive::vehicle {
namespace {

constexpr std::uint64_t kMapStream = 0x3a9;
constexpr std::uint64_t kObjectStream = 0x0b1ec7;

}  // namespace

Pose drawn_map_motion(const Conditions& conditions, std::uint64_t seed) {
  Random random(seed, kMapStream);
  const double turn = deg_to_rad(conditions.map_turn_sigma_deg) * random.normal();
  return {horizontal_draw(random, conditions.map_shift_sigma_m), from_rpy(0.0, 0.0, turn)};
}

planning::World drawn_world(planning::World map, const Conditions& conditions, std::uint64_t seed) {
  const bool is_exact = conditions.map_shift_sigma_m == 0.0 &&
                        conditions.map_turn_sigma_deg == 0.0 &&
                        conditions.object_shift_sigma_m == 0.0;
  if (is_exact) return map;
  Random random(seed, kObjectStream);
  const Pose whole = drawn_map_motion(conditions, seed);
  std::map<std::string, Pose> moves;
  const auto move_of = [&](const std::string& name) -> const Pose& {
    const auto [entry, is_new] = moves.try_emplace(name, whole);
    if (is_new) entry->second.p += horizontal_draw(random, conditions.object_shift_sigma_m);
    return entry->second;
  };
  for (planning::Obstacle& obstacle : map.obstacles) {
    obstacle.X_WO = move_of(obstacle.name) * obstacle.X_WO;
  }
  for (planning::Surface& surface : map.surfaces) {
    const Pose& move = move_of(surface.name);
    for (Eigen::Vector3d& vertex : surface.mesh.vertices) vertex = move * vertex;
  }
  return map;
}

}  // namespace dive::vehicle
