// Rules: the mission makes progress from every state, and ends at the surface.

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "mission/document/rule_set.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {
namespace {

using Trigger = Flow::Trigger;

const Flow::Arc& arc_of(const Flow& flow, int arc) {
  return flow.arcs()[static_cast<std::size_t>(arc)];
}

bool leads_on(const Flow::Arc& arc) { return !arc.only_emergency && !arc.lands.empty(); }

bool is_active_alone(const StateIndex& index, int state) {
  const StateType type = index.spec(state).type;
  return type == StateType::kAtomic || type == StateType::kFinal;
}

bool is_trap(const Flow& flow, const StateIndex& index, int state) {
  const bool is_end = index.spec(state).type == StateType::kFinal && index.parent(state) < 0;
  if (!flow.entered(state) || !is_active_alone(index, state) || is_end) return false;
  const std::vector<int>& arcs = flow.arcs_from(state);
  return std::none_of(arcs.begin(), arcs.end(),
                      [&](int arc) { return leads_on(arc_of(flow, arc)); });
}

// True if an exit other than its timeout or a failed plan leads out of the atomic state.
bool is_done_noticed(const Flow& flow, int state) {
  const std::vector<int>& arcs = flow.arcs_from(state);
  return std::any_of(arcs.begin(), arcs.end(), [&](int a) {
    const Flow::Arc& arc = arc_of(flow, a);
    return leads_on(arc) &&
           std::any_of(arc.triggers.begin(), arc.triggers.end(), [](const Trigger& trigger) {
             return trigger.kind == Trigger::Kind::kDone || trigger.kind == Trigger::Kind::kAlways;
           });
  });
}

bool always_moves_on(const Flow::Arc& arc) {
  return arc.spec != nullptr && arc.spec->events.empty() && !arc.spec->guard && !arc.lands.empty();
}

// Atomic states in a loop of transitions that need neither event nor condition: the fixed point of
// removing those that lead out of the set.
std::vector<bool> restless(const Flow& flow, const StateIndex& index) {
  std::vector<bool> rests(static_cast<std::size_t>(index.size()), true);
  for (int state = 0; state < index.size(); ++state) {
    for (const int arc : flow.arcs_from(state)) {
      if (arc_of(flow, arc).owner == state && always_moves_on(arc_of(flow, arc))) {
        rests[static_cast<std::size_t>(state)] = false;
      }
    }
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (int state = 0; state < index.size(); ++state) {
      if (rests[static_cast<std::size_t>(state)]) continue;
      const std::vector<int>& arcs = flow.arcs_from(state);
      const bool stays = std::any_of(arcs.begin(), arcs.end(), [&](int a) {
        const Flow::Arc& arc = arc_of(flow, a);
        return arc.owner == state && always_moves_on(arc) &&
               std::any_of(arc.lands.begin(), arc.lands.end(),
                           [&](int to) { return !rests[static_cast<std::size_t>(to)]; });
      });
      if (stays) continue;
      rests[static_cast<std::size_t>(state)] = changed = true;
    }
  }
  rests.flip();
  return rests;
}

}  // namespace

// Only the outermost of nested states is reported.
void states_are_reachable(const Subject& subject, const Flow& flow) {
  for (int state = 0; state < subject.index.size(); ++state) {
    const int parent = subject.index.parent(state);
    if (flow.entered(state) || (parent >= 0 && !flow.entered(parent))) continue;
    const Located<std::string>& id = subject.index.spec(state).id;
    subject.error("MIS-UNREACHABLE", id.span, fmt::format("'{}' cannot be reached", id.value),
                  "add a transition whose target it is, or remove it");
  }
}

void states_have_an_exit_path(const Subject& subject, const Flow& flow) {
  for (int state = 0; state < subject.index.size(); ++state) {
    if (!is_trap(flow, subject.index, state)) continue;
    const StateSpec& spec = subject.index.spec(state);
    const int parent = subject.index.parent(state);
    const bool completes = spec.type == StateType::kFinal && parent >= 0;
    const Located<std::string>& done = completes ? subject.index.spec(parent).id : spec.id;
    subject.error(
        "MIS-TRAP", done.span,
        completes ? fmt::format("no transition follows when '{}' is done", done.value)
                  : fmt::format("no transition leaves '{}'", done.value),
        fmt::format("add a <transition event=\"done.state.{}\" target=\"...\"/>", done.value));
  }
}

void done_is_noticed(const Subject& subject, const Flow& flow) {
  for (int state = 0; state < subject.index.size(); ++state) {
    const StateSpec& spec = subject.index.spec(state);
    if (!flow.entered(state) || !is_behavior(spec) || is_trap(flow, subject.index, state) ||
        is_done_noticed(flow, state)) {
      continue;
    }
    subject.warning(
        "MIS-DONE", spec.id.span,
        fmt::format("no transition follows when '{}' is done: it waits for its timeout",
                    spec.id.value),
        fmt::format("add a <transition event=\"done.state.{}\" target=\"...\"/>", spec.id.value));
  }
}

void machine_comes_to_rest(const Subject& subject, const Flow& flow) {
  const std::vector<bool> moving = restless(flow, subject.index);
  const auto first = std::find(moving.begin(), moving.end(), true);
  if (first == moving.end()) return;
  const auto& id = subject.index.spec(static_cast<int>(first - moving.begin())).id;
  subject.error(
      "MIS-LIVELOCK", id.span,
      fmt::format("transitions without event and condition from '{}' form a cycle", id.value),
      "give one of them an event or a condition");
}

void mission_ends(const Subject& subject, const Flow& flow) {
  const StateIndex& index = subject.index;
  std::vector<bool> ends = flow.ends();
  const std::vector<bool> can_end = flow.can_reach(ends);
  if (std::none_of(flow.first().begin(), flow.first().end(),
                   [&](int state) { return can_end[static_cast<std::size_t>(state)]; })) {
    subject.error("MIS-NO-FINAL", subject.mission.initial.span,
                  fmt::format("from '{}' no final state of the mission can be reached",
                              subject.mission.initial.value),
                  "a <final> directly in <states> ends the mission");
    return;
  }
  // States that only lead into a trap are not reported in addition.
  for (int state = 0; state < index.size(); ++state) {
    if (is_trap(flow, index, state)) ends[static_cast<std::size_t>(state)] = true;
  }
  const std::vector<bool> goes_on = flow.can_reach(ends);
  for (int state = 0; state < index.size(); ++state) {
    if (!flow.entered(state) || !is_active_alone(index, state)) continue;
    if (goes_on[static_cast<std::size_t>(state)]) continue;
    const Located<std::string>& id = index.spec(state).id;
    subject.error("MIS-NO-END", id.span,
                  fmt::format("from '{}' no final state of the mission can be reached", id.value));
  }
}

void mission_surfaces(const Subject& subject, const Flow& flow) {
  const StateIndex& index = subject.index;
  std::vector<bool> surfacing(static_cast<std::size_t>(index.size()), false);
  for (int state = 0; state < index.size(); ++state) {
    surfacing[static_cast<std::size_t>(state)] = is_surfacing(index.spec(state));
  }
  const std::vector<bool> ends = flow.ends();
  const std::vector<bool> anyhow = flow.reached_without(std::vector<bool>(surfacing.size(), false));
  const std::vector<bool> submerged = flow.reached_without(surfacing);
  bool surfaces = false;
  for (std::size_t state = 0; state < surfacing.size(); ++state) {
    surfaces |= surfacing[state] && anyhow[state];
  }
  for (int state = 0; state < index.size(); ++state) {
    if (!ends[static_cast<std::size_t>(state)] || !submerged[static_cast<std::size_t>(state)])
      continue;
    const Located<std::string>& id = index.spec(state).id;
    if (surfaces) {
      subject.warning("MIS-ENDS-SUBMERGED", id.span,
                      fmt::format("'{}' can be reached without surfacing first", id.value));
    } else {
      subject.error("MIS-NEVER-SURFACES", id.span,
                    fmt::format("the mission ends in '{}' without ever surfacing", id.value),
                    "add a <surface> before it");
    }
  }
}

}  // namespace dive::mission
