#include "mission/check/rules.h"

#include <iterator>

#include "mission/check/check_context.h"
#include "mission/states/state_elements.h"

namespace dive::mission {
namespace {

constexpr Rule kRules[] = {
    {"CHK-NO-GROUND", Severity::kError, "Positions given by ALTITUDE have ground below."},
    {"CHK-ABOVE-SURFACE", Severity::kError,
     "Positions given by ALTITUDE are not above the surface."},
    {"CHK-TOO-DEEP", Severity::kError, "Positions given by ALTITUDE are not below max_depth."},
    {"CHK-INSIDE", Severity::kError, "At start and goals the hull touches no obstacle."},
    {"CHK-CLEARANCE", Severity::kError,
     "At goals the hull keeps its clearance. (At the start see CHK-PLAN.)"},
    {"CHK-ALTITUDE", Severity::kError, "Start and goals keep the minimum altitude."},
    {"CHK-OVERHEAD", Severity::kWarning, "States with a goal under an overhead declare it."},
    {"CHK-TIMEOUT", Severity::kError, "A timeout is no shorter than the straight path takes."},
    {"CHK-SURFACE-OVERHEAD", Severity::kError, "No state leads to 'surface' under an overhead."},
};

constexpr void (*kPositionRules[])(CheckContext&) = {
    positions_have_ground,
    positions_are_in_the_water,
    positions_are_clear,
    positions_keep_altitude,
};
constexpr void (*kWayRules[])(CheckContext&) = {
    overheads_are_declared,
    legs_fit_their_timeouts,
    surfacing_is_unobstructed,
    states_obey_their_own_rules,
};

constexpr Rule kMapRules[] = {
    {"MAP-ROOT", Severity::kError,
     "A map is an SDF file, or a bathymetric grid (GeoTIFF, ESRI ASCII)."},
    {"MAP-VERSION", Severity::kError, "Its SDF version is from 1.4 to 1.11."},
    {"MAP-WORLDS", Severity::kError, "A map holds one world."},
    {"MAP-MISSING", Severity::kError, "Elements have the required names, shapes and values."},
    {"MAP-NUMBER", Severity::kError, "Numbers are finite, as many as required, and within 1e6."},
    {"MAP-SIZE", Severity::kError, "Sizes are greater than zero."},
    {"MAP-FRAME", Severity::kError, "Poses are relative to the parent element."},
    {"MAP-ORIGIN", Severity::kWarning,
     "The origin of a map is on EARTH_WGS84, its axes are east, north and up."},
    {"MAP-GEOMETRY", Severity::kError, "A collision has one known shape."},
    {"MAP-UNSUPPORTED", Severity::kError,
     "The map contains nothing solid that cannot be represented."},
    {"MAP-MOVABLE", Severity::kWarning, "Models of a map are static."},
    {"MAP-MESH", Severity::kError, "The file of a mesh exists and contains triangles."},
    {"MAP-OUTSIDE", Severity::kError,
     "Meshes lie in the map's folder, or --allow-outside is given."},
    {"MAP-EXTENT", Severity::kError, "Vertices of a mesh are within 10 km of its origin."},
    {"MAP-COARSE", Severity::kWarning, "200,000 convex pieces of a mesh keep within 0.05 m of it."},
    {"MAP-MESH-UNIT", Severity::kWarning, "<scale> agrees with the unit that a mesh file states."},
    {"MAP-MESH-UP-AXIS", Severity::kWarning, "The up axis that a mesh file states points up."},
    {"MAP-MESH-UPSIDE-DOWN", Severity::kWarning, "The up axis of a mesh does not point down."},
    {"MAP-MESH-ON-EDGE", Severity::kWarning, "A thin mesh over 20 m high does not stand on edge."},
    {"MAP-MESH-ABOVE-SURFACE", Severity::kWarning, "A mesh is not above the surface (z = 0)."},
    {"MAP-MESH-EMERGES", Severity::kWarning, "A mesh other than ground stays below the surface."},
    {"MAP-MESH-LARGE", Severity::kWarning, "A mesh is at most 5 km long and 300 m high."},
    {"MAP-MESH-SMALL", Severity::kWarning, "The meshes of a map span at least 1 m."},
};

}  // namespace

std::span<const Rule> world_rules() { return kRules; }

std::span<const Rule> map_rules() { return kMapRules; }

std::vector<Rule> all_rules() {
  const std::span<const Rule> document = document_rules();
  std::vector<Rule> rules(document.begin(), document.end());
  rules.insert(rules.end(), std::begin(kMapRules), std::end(kMapRules));
  rules.insert(rules.end(), std::begin(kRules), std::end(kRules));
  const std::vector<Rule> of_states = state_rules();
  rules.insert(rules.end(), of_states.begin(), of_states.end());
  return rules;
}

void check_against_world(const Mission& mission, const planning::World& world,
                         const planning::RobotHull& hull, Diagnostics& diagnostics) {
  CheckContext context(mission, world, hull, diagnostics);
  const std::size_t errors_before = diagnostics.error_count();
  for (const auto rule : kPositionRules) rule(context);
  // Legs are checked only if all positions are valid.
  if (diagnostics.error_count() == errors_before) {
    for (const auto rule : kWayRules) rule(context);
  }
  diagnostics.sort();
}

}  // namespace dive::mission
