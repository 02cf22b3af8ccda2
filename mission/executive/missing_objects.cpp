#include "mission/executive/missing_objects.h"

#include <fmt/format.h>

namespace dive::mission {
namespace {

constexpr int kScans = 4;  // until it is reported

}  // namespace

MissingObjects::MissingObjects(const planning::World& world)
    : world_(world), scans_(world.obstacles.size() + world.surfaces.size(), 0) {}

std::optional<std::string> MissingObjects::observe(int object) {
  if (object < 0 || static_cast<std::size_t>(object) >= scans_.size()) return std::nullopt;
  if (++scans_[static_cast<std::size_t>(object)] != kScans) return std::nullopt;
  return fmt::format(
      "'{}' is not where the map has it: {} scans saw through it; it stays an obstacle",
      planning::object_name(world_, object), kScans);
}

}  // namespace dive::mission
