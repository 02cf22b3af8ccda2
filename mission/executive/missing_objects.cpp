#include "mission/executive/missing_objects.h"

#include <fmt/format.h>

namespace dive::mission {
namespace {

constexpr int kScans = 4;  // until it is reported

}  // namespace

MissingObjects::MissingObjects(const planning::World& world, bool trusts_absence)
    : world_(world), trusts_absence_(trusts_absence), scans_(world.obstacles.size(), 0) {}

std::optional<std::string> MissingObjects::observe(int object) {
  if (!has(object)) return std::nullopt;
  const auto index = static_cast<std::size_t>(object);
  if (++scans_[index] != kScans) return std::nullopt;
  return fmt::format(
      "'{}' is not where the map has it: {} scans saw through it; it stays an "
      "obstacle{}",
      world_.obstacles[index].name, kScans,
      trusts_absence_ ? " until more of it is seen through from more places" : "");
}

std::optional<std::string> MissingObjects::describe(const planning::ObjectChange& change) const {
  if (!has(change.first)) return std::nullopt;
  const std::string& name = world_.obstacles[static_cast<std::size_t>(change.first)].name;
  if (!change.is_absent) {
    return fmt::format("'{}' is observed where the map has it: an obstacle again", name);
  }
  return fmt::format(
      "'{}' is gone: {} scans saw through {:.0f} % of it; only the rest remains an "
      "obstacle",
      name, change.scans, 100.0 * change.seen_share);
}

}  // namespace dive::mission
