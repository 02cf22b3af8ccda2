// Rules for a scenario beyond its schema, and together with its mission.

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "common/suggest.h"
#include "mission/document/state_index.h"
#include "mission/executive/behavior_factory.h"
#include "mission/executive/machine.h"
#include "mission/scenario/scenario.h"
#include "mission/simulation/simulated_dive.h"
#include "mission/states/atomic_state.h"
#include "planning/world/scene.h"

namespace dive::mission {
namespace {

constexpr Rule kRules[] = {
    {"SCN-MISSION-PATH", Severity::kError,
     "The path of the mission is relative to the scenario's file."},
    {"SCN-MISSION", Severity::kError, "The mission exists, and is accepted."},
    {"SCN-CONDITION", Severity::kError, "Every condition is within its range."},
    {"SCN-WHEN", Severity::kError, "Every 'at' has one trigger."},
    {"SCN-EXPECT", Severity::kError, "The scenario has an expectation."},
    {"SCN-BOUNDS", Severity::kError,
     "Every quantity has a bound, and its bounds are not contradictory."},
    {"SCN-OBSTACLE", Severity::kError, "Every obstacle has one place: x, y and depth, or ahead."},
    {"SCN-DIVER", Severity::kError,
     "A scenario has at most one diver, who stays under water; 'diver_clearance' needs one."},
    {"SCN-STEP-ID", Severity::kError,
     "No two 'at' have the same id, and every 'after' is the id of one."},
    {"SCN-STATE", Severity::kError, "Every state is one of the mission's or the executive's own."},
    {"SCN-EVENT", Severity::kError, "Every event can be raised in the mission."},
    {"SCN-GOAL", Severity::kError, "Every goal is one of the mission's."},
    {"SCN-PAYLOAD", Severity::kError, "Every payload command is one that the mission gives."},
    {"SCN-TOO-LATE", Severity::kError,
     "No time or bound lies beyond the end of the longest dive: such an expectation would test "
     "nothing."},
};

using Kind = Expectation::Kind;
using Names = std::set<std::string>;

struct Vocabulary {
  Names states;
  Names events;
  Names goals;
  Names payloads;
};

Vocabulary vocabulary_of(const Mission& mission, const StateIndex& index) {
  Vocabulary words;
  for (std::string& id : index.ids()) words.states.insert(std::move(id));
  words.events = possible_events(index);
  words.events.insert("failsafe.retrace_failure");
  const Machine machine = build_machine(mission);
  for (const statechart::State& state : machine.chart.states) {
    if (!state.id.starts_with("dive.")) continue;
    words.states.insert(state.id);
    words.events.insert("done.state." + state.id);
  }
  for (const char* event : {kRetraceEvent, kAbortEvent, kEmergencyEvent}) {
    words.events.insert(event);
  }
  for (int state = 0; state < index.size(); ++state) {
    const StateSpec& spec = index.spec(state);
    for (const Goal* goal : goals_of(spec)) {
      words.goals.insert(spec.atomic->is_its_goal() ? spec.id.value : goal->id.value);
    }
    for (const ActionSpec* action : actions_of(spec)) {
      if (action->kind == ActionSpec::Kind::kPayload) words.payloads.insert(action->text.value);
    }
  }
  return words;
}

class Checker {
 public:
  Checker(Scenario& scenario, const Mission& mission, Diagnostics& diagnostics)
      : scenario_(scenario),
        mission_(mission),
        index_(mission),
        words_(vocabulary_of(mission, index_)),
        diagnostics_(diagnostics) {}

  void check() {
    for (const ScriptStep& step : scenario_.steps) check_step(step);
    for (const Expectation& expectation : scenario_.expectations) {
      check_names(expectation);
      check_diver(expectation);
      check_times(expectation);
    }
  }

  void place_goals(const planning::Scene& scene) {
    for (Expectation& expectation : scenario_.expectations) {
      if (expectation.kind != Kind::kReaches) continue;
      for (int state = 0; state < index_.size(); ++state) {
        const StateSpec& spec = index_.spec(state);
        for (const Goal* goal : goals_of(spec)) {
          if (goal->id.value != expectation.name.value) continue;
          expectation.place_W = leg_goal(scene, *goal).position_W;
        }
      }
    }
  }

 private:
  void error(const char* code, Span span, std::string message, std::string hint = {}) {
    diagnostics_.error(code, scenario_.source, span, std::move(message), std::move(hint));
  }

  void need(const char* code, const Located<std::string>& word, const Names& known,
            const char* sentence) {
    if (known.contains(word.value)) return;
    const std::vector<std::string> candidates(known.begin(), known.end());
    const std::optional<std::string> meant = closest_match(word.value, candidates);
    const bool is_few = !candidates.empty() && candidates.size() <= 8;
    error(code, word.span, fmt::format(fmt::runtime(sentence), word.value),
          meant    ? fmt::format("did you mean '{}'?", *meant)
          : is_few ? fmt::format("there are {}", fmt::join(candidates, ", "))
                   : std::string());
  }

  void need_state(const Located<std::string>& name) {
    need("SCN-STATE", name, words_.states, "the mission has no state '{}'");
  }
  void need_event(const Located<std::string>& name) {
    need("SCN-EVENT", name, words_.events, "nothing in the mission raises '{}'");
  }
  void need_goal(const Located<std::string>& name) {
    need("SCN-GOAL", name, words_.goals, "the mission has no goal '{}'");
  }

  void check_step(const ScriptStep& step) {
    if (!step.id.value.empty() && !ids_.insert(step.id.value).second) {
      error("SCN-STEP-ID", step.id.span,
            fmt::format("the id '{}' is taken already", step.id.value));
    }
    const Trigger& trigger = step.trigger;
    if (trigger.kind == Trigger::Kind::kState) need_state(trigger.name);
    if (trigger.kind == Trigger::Kind::kEvent) need_event(trigger.name);
    if (trigger.kind == Trigger::Kind::kGoal) need_goal(trigger.name);
    if (trigger.after_s >= longest_dive_s(mission_)) too_late(step.span);
  }

  void too_late(Span span) {
    error(
        "SCN-TOO-LATE", span,
        fmt::format("no dive of this mission lasts longer than {:g} s", longest_dive_s(mission_)));
  }

  void check_names(const Expectation& expectation) {
    const Located<std::string>& name = expectation.name;
    switch (expectation.kind) {
      case Kind::kFinalState:
      case Kind::kEnters:
        return need_state(name);
      case Kind::kEvent:
        return need_event(name);
      case Kind::kPayload:
        return need("SCN-PAYLOAD", name, words_.payloads,
                    "the mission has no payload command '{}'");
      case Kind::kHeadsFor:
      case Kind::kReaches:
        return need_goal(name);
      default:
        return;
    }
  }

  void check_diver(const Expectation& expectation) {
    const bool is_of_diver =
        expectation.kind == Kind::kBounds && expectation.name.value == "diver_clearance";
    if (!is_of_diver || scenario_.diver) return;
    error("SCN-DIVER", expectation.span, "the scenario has no diver", "add a 'diver'");
  }

  void check_times(const Expectation& expectation) {
    if (!expectation.after.value.empty()) {
      need("SCN-STEP-ID", expectation.after, ids_, "no 'at' has the id '{}'");
    }
    const double longest = longest_dive_s(mission_);
    if (expectation.within_s && expectation.within_s->value >= longest) {
      too_late(expectation.within_s->span);
    }
    const bool is_duration =
        expectation.kind == Kind::kBounds && expectation.name.value == "duration";
    if (is_duration && expectation.at_most && expectation.at_most->value >= longest) {
      too_late(expectation.at_most->span);
    }
  }

  Scenario& scenario_;
  const Mission& mission_;
  const StateIndex index_;
  const Vocabulary words_;
  Diagnostics& diagnostics_;
  Names ids_;
};

}  // namespace

std::span<const Rule> scenario_rules() { return kRules; }

bool suit_to_mission(Scenario& scenario, const Mission& mission, const planning::World& world,
                     Diagnostics& diagnostics) {
  const std::size_t errors_before = diagnostics.error_count();
  Checker checker(scenario, mission, diagnostics);
  checker.check();
  diagnostics.sort();
  if (diagnostics.error_count() != errors_before) return false;
  checker.place_goals(planning::Scene(world));
  return true;
}

}  // namespace dive::mission
