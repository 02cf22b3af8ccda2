// Rules: everything that a mission names exists and is named once.

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/suggest.h"
#include "mission/document/rule_set.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {
namespace {

constexpr int kMaxStates = 1000;
constexpr std::size_t kMaxTransitions = 2000;
constexpr std::size_t kMaxGoals = 1000;

bool is_goal(const StateIndex& index, const std::string& id) {
  for (int state = 0; state < index.size(); ++state) {
    for (const Goal* goal : goals_of(index.spec(state))) {
      if (goal->id.value == id) return true;
    }
  }
  return false;
}

// Hint for an id that is not a state.
std::string hint_for_state(const Subject& subject, const std::string& id) {
  if (is_goal(subject.index, id)) return fmt::format("'{}' is a goal, not a state", id);
  return did_you_mean(id, subject.index.ids());
}

// "a.b" matches a.b and everything that begins with "a.b."; a trailing ".*" adds nothing.
bool matches_any(std::string descriptor, const std::set<std::string>& events) {
  if (descriptor == "*") return true;
  if (descriptor.size() > 2 && descriptor.ends_with(".*")) {
    descriptor.resize(descriptor.size() - 2);
  }
  if (events.contains(descriptor)) return true;
  const auto next = events.lower_bound(descriptor + ".");
  return next != events.end() && next->starts_with(descriptor + ".");
}

}  // namespace

void not_too_many(const Subject& subject) {
  const StateIndex& index = subject.index;
  std::size_t transitions = 0;
  std::size_t goals = 0;
  for (int state = 0; state < index.size(); ++state) {
    if (state == kMaxStates) {
      subject.error("MIS-TOO-MANY", index.spec(state).id.span,
                    fmt::format("there are more than {} states", kMaxStates));
    }
    for (const Goal* goal : goals_of(index.spec(state))) {
      if (goals++ == kMaxGoals) {
        subject.error("MIS-TOO-MANY", goal->span,
                      fmt::format("there are more than {} goals", kMaxGoals));
      }
    }
    for (const TransitionSpec& transition : index.spec(state).transitions) {
      if (transitions++ == kMaxTransitions) {
        subject.error("MIS-TOO-MANY", transition.span,
                      fmt::format("there are more than {} transitions", kMaxTransitions));
      }
    }
  }
}

void ids_are_unique(const Subject& subject) {
  std::map<std::string, Span> seen;
  const auto note = [&](const Located<std::string>& id) {
    const auto [first, is_new] = seen.emplace(id.value, id.span);
    if (is_new) return;
    subject.error("MIS-ID-DUPLICATE", id.span,
                  fmt::format("the id '{}' is already used in line {}, column {}", id.value,
                              first->second.line, first->second.column),
                  "states and goals need different ids");
  };
  for (int state = 0; state < subject.index.size(); ++state) {
    const StateSpec& spec = subject.index.spec(state);
    note(spec.id);
    if (spec.atomic && spec.atomic->is_its_goal()) continue;
    for (const Goal* goal : goals_of(spec)) note(goal->id);
  }
}

// Dots are not allowed in an id, so the executive's "dive.abort" and the like cannot be named.
void ids_are_not_reserved(const Subject& subject) {
  for (int state = 0; state < subject.index.size(); ++state) {
    const Located<std::string>& id = subject.index.spec(state).id;
    if (id.value == "dive") {
      subject.error("MIS-ID-RESERVED", id.span, "the id 'dive' is reserved for the executive");
    }
  }
}

// An event raised by a mission must not be confused with one that reports an actual occurrence.
void raised_events_are_its_own(const Subject& subject) {
  constexpr std::string_view kReserved[] = {"done",  "timeout", "plan",      "failsafe", "operator",
                                            "abort", "map",     "estimator", "loop",     "dive"};
  for (int state = 0; state < subject.index.size(); ++state) {
    const StateSpec& spec = subject.index.spec(state);
    if (spec.is_generated) continue;
    for (const ActionSpec* action : actions_of(spec)) {
      if (action->kind != ActionSpec::Kind::kRaise) continue;
      const std::string family = action->text.value.substr(0, action->text.value.find('.'));
      if (std::ranges::find(kReserved, family) == std::end(kReserved)) continue;
      subject.error(
          "MIS-EVENT-RESERVED", action->text.span,
          fmt::format("events that begin with '{}' are reserved for the executive", family),
          "raise one with a name of your own");
    }
  }
}

void initial_states_exist(const Subject& subject) {
  const StateIndex& index = subject.index;
  const auto check = [&](const Located<std::string>& initial, int owner) {
    const int target = index.find(initial.value);
    if (target < 0) {
      subject.error("MIS-INITIAL", initial.span,
                    fmt::format("the initial state '{}' does not exist", initial.value),
                    hint_for_state(subject, initial.value));
    } else if (owner >= 0 && (target == owner || !index.is_within(target, owner))) {
      subject.error(
          "MIS-INITIAL", initial.span,
          fmt::format("'{}' is not inside '{}'", initial.value, index.spec(owner).id.value));
    }
  };
  check(subject.mission.initial, -1);
  for (int state = 0; state < index.size(); ++state) {
    const StateSpec& spec = index.spec(state);
    // A history records the children of its parent state.
    if (spec.initial) check(*spec.initial, is_history(spec) ? index.parent(state) : state);
  }
}

void targets_exist(const Subject& subject) {
  for (int state = 0; state < subject.index.size(); ++state) {
    for (const TransitionSpec& transition : subject.index.spec(state).transitions) {
      for (const Located<std::string>& target : transition.targets) {
        if (subject.index.find(target.value) >= 0) continue;
        subject.error("MIS-TARGET", target.span,
                      fmt::format("the target state '{}' does not exist", target.value),
                      hint_for_state(subject, target.value));
      }
    }
  }
}

void timeouts_lead_somewhere(const Subject& subject) {
  for (int state = 0; state < subject.index.size(); ++state) {
    const StateSpec& spec = subject.index.spec(state);
    const Timeout* timeout = state_timeout(spec);
    if (timeout == nullptr) continue;
    const Located<std::string>& next = timeout->on_timeout;
    if (next.value.empty()) {
      subject.error("MIS-TIMEOUT", timeout->seconds.span,
                    fmt::format("'{}' has a timeout but no on_timeout", spec.id.value),
                    "name the state to enter: a timeout is never a success");
    } else if (subject.index.find(next.value) < 0) {
      subject.error("MIS-TIMEOUT", next.span,
                    fmt::format("the on_timeout state '{}' does not exist", next.value),
                    hint_for_state(subject, next.value));
    }
  }
}

void events_are_raised(const Subject& subject) {
  const std::set<std::string> events = possible_events(subject.index);
  const std::vector<std::string> candidates(events.begin(), events.end());
  for (int state = 0; state < subject.index.size(); ++state) {
    for (const TransitionSpec& transition : subject.index.spec(state).transitions) {
      for (std::size_t i = 0; i < transition.events.size(); ++i) {
        const std::string& event = transition.events[i];
        if (matches_any(event, events)) continue;
        std::string hint = did_you_mean(event, candidates);
        if (hint.empty()) {
          hint =
              "there are done.state.ID, timeout.ID, plan.failed.ID, failsafe.NAME, abort and more: "
              "see 'event' in missions/mission.xsd";
        }
        subject.error("MIS-EVENT", transition.event_spans[i],
                      fmt::format("nothing in this mission raises '{}'", event), std::move(hint));
      }
    }
  }
}

}  // namespace dive::mission
