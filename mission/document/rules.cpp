#include "mission/document/rules.h"

#include "mission/document/rule_set.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {
namespace {

constexpr Rule kRules[] = {
    {"FILE-UNREADABLE", Severity::kError, "The file exists, is readable and is not too large."},
    {"XML-ENCODING", Severity::kError, "The file is UTF-8 text."},
    {"XML-DOCTYPE", Severity::kError, "The file has no DOCTYPE, and so no entities."},
    {"XML-SYNTAX", Severity::kError, "The file is well-formed XML."},
    {"XML-SCAN", Severity::kError, "The tags of the file can be located."},
    {"XML-SIZE", Severity::kError, "The file is not larger than 1 MiB."},
    {"XML-DEPTH", Severity::kError, "Elements are not nested more than 48 deep."},
    {"XML-COUNT", Severity::kError, "There are at most 20000 elements, and 256 attributes of one."},
    {"MIS-INCLUDE", Severity::kError,
     "An included file is a fragment beneath the mission's folder and does not include itself."},
    {"MIS-PARAMETER", Severity::kError, "Every parameter used is declared and has one value."},
    {"XSD-ROOT", Severity::kError, "The root is 'mission' in the namespace urn:dive:mission:1."},
    {"XSD-ELEMENT", Severity::kError, "Every element is known and allowed in its place."},
    {"XSD-MISSING-ELEMENT", Severity::kError, "Every required element is present."},
    {"XSD-ATTRIBUTE", Severity::kError, "Every attribute belongs to its element."},
    {"XSD-MISSING-ATTRIBUTE", Severity::kError, "Every required attribute is present."},
    {"XSD-VALUE", Severity::kError, "Every value is of its type and within its range."},
    {"XSD-TEXT", Severity::kError, "There is no text where only elements are allowed."},
    {"MIS-COND", Severity::kError, "Every condition can be parsed and has a Boolean value."},
    {"MIS-ORIGIN", Severity::kError,
     "A mission with latitudes and longitudes has an origin; magnetic headings have a "
     "declination."},
    {"MIS-POSITION", Severity::kError,
     "Every position is x and y, or latitude and longitude within 20 km of the origin."},
    {"MIS-MAP", Severity::kError,
     "The map is either a file or unknown; attributes of unknown environments belong to the "
     "latter."},
    {"MIS-MAP-OUTSIDE", Severity::kError,
     "The map is beneath the mission's folder, also after symbolic links."},
    {"MIS-MAP-NOT-FOUND", Severity::kError, "The map file exists."},
    {"MIS-MAP-ORIGIN", Severity::kError,
     "A map that states its origin has that of the mission, within 0.01 m."},
    {"MIS-CURRENT", Severity::kError,
     "A declared current is constant (speed and towards_deg) or a table with its start."},
    {"MIS-CURRENT-TABLE", Severity::kError,
     "The table of a current is a CSV file beneath the mission's folder, its rows in order of "
     "time."},
    {"MIS-TOO-MANY", Severity::kError,
     "There are at most 1000 states, 1000 goals, 2000 transitions."},
    {"MIS-ID-DUPLICATE", Severity::kError, "No two states or goals have the same id."},
    {"MIS-ID-RESERVED", Severity::kError, "No state uses an id reserved for the executive."},
    {"MIS-EVENT-RESERVED", Severity::kError,
     "No mission raises an event reserved for the executive."},
    {"MIS-INITIAL", Severity::kError, "Every initial state exists inside its parent."},
    {"MIS-TARGET", Severity::kError, "Every target is a state of the mission."},
    {"MIS-TIMEOUT", Severity::kError, "A timeout has an on_timeout that names a state."},
    {"MIS-EVENT", Severity::kError, "Every event that a transition waits for can be raised."},
    {"MIS-TRANSITION", Severity::kError, "A transition without an event has a target."},
    {"MIS-NEVER-FIRES", Severity::kWarning,
     "No transition is always pre-empted by an earlier one."},
    {"MIS-TARGETS", Severity::kError,
     "Several targets of a transition are in different regions of a parallel."},
    {"MIS-HISTORY", Severity::kError, "The default of a history is a state that it can record."},
    {"MIS-IDLE", Severity::kError,
     "Every state that must steer the vehicle contains one that does."},
    {"MIS-PARALLEL", Severity::kError, "Exactly one region of a parallel steers the vehicle."},
    {"MIS-SPEED", Severity::kError, "The vehicle can swim at the speed."},
    {"MIS-ABOVE-SURFACE", Severity::kError, "Start, goals and tags are not above the surface."},
    {"MIS-TOO-DEEP", Severity::kError, "Start and goals are not deeper than limits/@max_depth."},
    {"MIS-ALTITUDE-OVERHEAD", Severity::kError,
     "Under an overhead no goal uses ALTITUDE, because altitude is measured from the first solid "
     "below the surface."},
    {"MIS-ALTITUDE-UNKNOWN", Severity::kError,
     "In an unknown environment nothing uses ALTITUDE, because the ground is not known at the "
     "start."},
    {"MIS-MAPPING-SENSOR", Severity::kError,
     "Mapping with cameras requires estimator=\"visual_inertial\"."},
    {"MIS-NEEDS-FIXES", Severity::kError,
     "trust_absence and information=\"prefer\" require map fixes."},
    {"MIS-ABSENCE", Severity::kError,
     "trust_absence requires a sensor that maps what the known map lacks."},
    {"MIS-TAG-DUPLICATE", Severity::kError, "No two tags have the same id."},
    {"MIS-TAG-UNUSED", Severity::kError,
     "Tags require the visual-inertial estimator and a known map."},
    {"MIS-SURFACE-OVERHEAD", Severity::kError, "No 'surface' is declared to be under an overhead."},
    {"MIS-TIME", Severity::kWarning, "No timeout is longer than the mission's."},
    {"MIS-LIMITS", Severity::kError, "The limits leave space between the surface and max_depth."},
    {"MIS-REDUCED-CLEARANCE", Severity::kError,
     "No reduced_clearance is more than limits/@clearance."},
    {"MIS-FAILSAFE", Severity::kWarning,
     "Failsafes that the vehicle cannot survive under water bring it up."},
    {"MIS-UNREACHABLE", Severity::kError, "Every state can be reached."},
    {"MIS-TRAP", Severity::kError, "Every state can be left in the course of the mission."},
    {"MIS-DONE", Severity::kWarning, "A transition follows when a state is done."},
    {"MIS-LIVELOCK", Severity::kError, "Transitions without an event do not form a cycle."},
    {"MIS-NO-FINAL", Severity::kError, "A final state of the mission can be reached."},
    {"MIS-NO-END", Severity::kError, "From every state a final state can be reached."},
    {"MIS-NEVER-SURFACES", Severity::kError, "The mission can end at the surface."},
    {"MIS-ENDS-SUBMERGED", Severity::kWarning, "The mission cannot end under water."},
};

// The rules that an element has of its own.
void states_obey_their_own_rules(const Subject& subject, Diagnostics& diagnostics) {
  for (int state = 0; state < subject.index.size(); ++state) {
    const StateSpec& spec = subject.index.spec(state);
    if (spec.atomic) spec.atomic->check(subject.mission, spec, diagnostics);
  }
}

using DocumentRule = void (*)(const Subject&);

constexpr DocumentRule kNameRules[] = {
    not_too_many,         ids_are_unique, ids_are_not_reserved,    raised_events_are_its_own,
    initial_states_exist, targets_exist,  timeouts_lead_somewhere, events_are_raised,
};
constexpr DocumentRule kStructureRules[] = {
    transitions_say_something,    transitions_can_fire, targets_fit_together,
    histories_remember_their_own, someone_steers,
};
constexpr DocumentRule kValueRules[] = {
    speed_suits_the_vehicle,     positions_are_under_water,   positions_respect_max_depth,
    altitudes_are_in_open_water, altitudes_have_known_ground, mapping_cameras_are_used,
    information_is_available,    absence_can_be_observed,     surfacing_is_in_open_water,
    times_fit_into_the_mission,  limits_leave_clearance,      reduced_clearances_are_less,
    failsafes_bring_it_up,       tags_are_distinct,           tags_can_be_used,
};
constexpr void (*kFlowRules[])(const Subject&, const Flow&) = {
    states_are_reachable, states_have_an_exit_path, done_is_noticed, machine_comes_to_rest,
    mission_ends,         mission_surfaces,
};

}  // namespace

std::span<const Rule> document_rules() { return kRules; }

void check_rules(const Mission& mission, Diagnostics& diagnostics) {
  const Subject subject(mission, diagnostics);
  const std::size_t errors_before = diagnostics.error_count();
  for (const DocumentRule rule : kNameRules) rule(subject);
  for (const DocumentRule rule : kStructureRules) rule(subject);
  const bool is_machine = diagnostics.error_count() == errors_before;
  for (const DocumentRule rule : kValueRules) rule(subject);
  states_obey_their_own_rules(subject, diagnostics);
  // Flow is checked only for a valid machine.
  if (!is_machine) return;
  const Flow flow(mission, subject.index);
  for (const auto rule : kFlowRules) rule(subject, flow);
}

}  // namespace dive::mission
