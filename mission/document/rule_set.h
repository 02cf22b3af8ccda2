#pragma once
// The rules behind check_rules(): one function each. Private to mission/document.

#include <string>

#include "common/diagnostic.h"
#include "mission/document/flow.h"
#include "mission/document/mission.h"
#include "mission/document/state_index.h"

namespace dive::mission {

/// The mission that a rule checks, and the destination of its findings.
class Subject {
 public:
  Subject(const Mission& whole, Diagnostics& diagnostics)
      : mission(whole), index(whole), diagnostics_(diagnostics) {}

  const Mission& mission;
  const StateIndex index;

  void error(const char* code, Span span, std::string message, std::string hint = {}) const {
    diagnostics_.error(code, mission.source, span, std::move(message), std::move(hint));
  }
  void warning(const char* code, Span span, std::string message, std::string hint = {}) const {
    diagnostics_.warning(code, mission.source, span, std::move(message), std::move(hint));
  }

 private:
  Diagnostics& diagnostics_;
};

// Names: everything that is named exists once. (name_rules.cpp)
void not_too_many(const Subject& subject);
void ids_are_unique(const Subject& subject);
void ids_are_not_reserved(const Subject& subject);
void raised_events_are_its_own(const Subject& subject);
void initial_states_exist(const Subject& subject);
void targets_exist(const Subject& subject);
void timeouts_lead_somewhere(const Subject& subject);
void events_are_raised(const Subject& subject);

// Structure: the states form one valid machine. (structure_rules.cpp)
void transitions_say_something(const Subject& subject);
void transitions_can_fire(const Subject& subject);
void targets_fit_together(const Subject& subject);
void histories_remember_their_own(const Subject& subject);
void someone_steers(const Subject& subject);

// Values: limits, positions, times. (value_rules.cpp)
void speed_suits_the_vehicle(const Subject& subject);
void positions_are_under_water(const Subject& subject);
void positions_respect_max_depth(const Subject& subject);
void altitudes_are_in_open_water(const Subject& subject);
void altitudes_have_known_ground(const Subject& subject);
void mapping_cameras_are_used(const Subject& subject);
void information_is_available(const Subject& subject);
void absence_can_be_observed(const Subject& subject);
void surfacing_is_in_open_water(const Subject& subject);
void times_fit_into_the_mission(const Subject& subject);
void limits_leave_clearance(const Subject& subject);
void reduced_clearances_are_less(const Subject& subject);
void failsafes_bring_it_up(const Subject& subject);
void tags_are_distinct(const Subject& subject);
void tags_can_be_used(const Subject& subject);

// Flow: the mission makes progress, and ends at the surface. (flow_rules.cpp)
void states_are_reachable(const Subject& subject, const Flow& flow);
void states_have_an_exit_path(const Subject& subject, const Flow& flow);
void done_is_noticed(const Subject& subject, const Flow& flow);
void machine_comes_to_rest(const Subject& subject, const Flow& flow);
void mission_ends(const Subject& subject, const Flow& flow);
void mission_surfaces(const Subject& subject, const Flow& flow);

}  // namespace dive::mission
