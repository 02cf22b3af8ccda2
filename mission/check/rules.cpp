#include "mission/check/rules.h"

#include <iterator>

#include "mission/check/site.h"

namespace dive::mission {
namespace {

constexpr Rule kRules[] = {
    {"CHK-NO-GROUND", Severity::kError, "What is given by altitude has ground below it."},
    {"CHK-ABOVE-SURFACE", Severity::kError, "What is given by altitude is not above the surface."},
    {"CHK-TOO-DEEP", Severity::kError, "What is given by altitude is not below max_depth."},
    {"CHK-INSIDE", Severity::kError, "At start and goals the hull touches no obstacle."},
    {"CHK-CLEARANCE", Severity::kError, "At start and goals the hull keeps its clearance."},
    {"CHK-ALTITUDE", Severity::kError, "Start and goals keep the minimum altitude."},
    {"CHK-OVERHEAD", Severity::kWarning, "States with a goal under an overhead say so."},
    {"CHK-TIMEOUT", Severity::kError, "A timeout is no shorter than the straight way takes."},
    {"CHK-SURFACE-OVERHEAD", Severity::kError, "Nothing leads to 'surface' under an overhead."},
};

constexpr void (*kPositionRules[])(Site&) = {
    positions_have_ground,
    positions_are_in_the_water,
    positions_are_clear,
    positions_keep_altitude,
};
constexpr void (*kWayRules[])(Site&) = {
    overheads_are_declared,
    legs_fit_their_timeouts,
    surfacing_is_unobstructed,
};

// What the readers of map and vehicle say is theirs to list; these stand for the map's.
constexpr Rule kMapRules[] = {
    {"MAP-*", Severity::kError, "The map is an SDF world of primitives that can be represented."},
};

}  // namespace

std::span<const Rule> world_rules() { return kRules; }

std::vector<Rule> all_rules() {
  const std::span<const Rule> document = document_rules();
  std::vector<Rule> rules(document.begin(), document.end());
  rules.insert(rules.end(), std::begin(kMapRules), std::end(kMapRules));
  rules.insert(rules.end(), std::begin(kRules), std::end(kRules));
  return rules;
}

void check_against_world(const Mission& mission, const planning::World& world,
                         const planning::RobotHull& hull, Diagnostics& diagnostics) {
  Site site(mission, world, hull, diagnostics);
  const std::size_t errors_before = diagnostics.error_count();
  for (const auto rule : kPositionRules) rule(site);
  // How to get there and away is a question only of places where one can be.
  if (diagnostics.error_count() == errors_before) {
    for (const auto rule : kWayRules) rule(site);
  }
  diagnostics.sort();
}

}  // namespace dive::mission
