#include "mission/card/abort_table.h"

#include <algorithm>
#include <array>
#include <tuple>

#include <fmt/format.h>

#include "behaviors/failsafes.h"
#include "mission/card/card_text.h"

namespace dive::mission {
namespace {

using behaviors::FailsafeKind;
using behaviors::FailsafePolicy;
using behaviors::Rung;

struct FaultWords {
  FailsafeKind kind;
  const char* words;  ///< {} is the limit.
};

constexpr std::array<FaultWords, behaviors::kFailsafeCount> kFaultWords = {{
    {FailsafeKind::kLeak, "water in the hull"},
    {FailsafeKind::kBattery, "charge below {:.0f} %"},
    {FailsafeKind::kTemperature, "hull above {:g} \u00b0C"},
    {FailsafeKind::kOverdepth, "deeper than {:g} m"},
    {FailsafeKind::kMinAltitude, "less than {:g} m above the ground"},
    {FailsafeKind::kGeofence, "outside the fence"},
    {FailsafeKind::kMissionTimeout, "time limit of the mission"},
    {FailsafeKind::kLegTimeout, "a leg takes {:g} times its time"},
    {FailsafeKind::kStuck, "no progress for {:g} s"},
    {FailsafeKind::kImuLost, "no attitude for {:g} s, or frozen"},
    {FailsafeKind::kDepthLost, "no depth for {:g} s, or frozen"},
    {FailsafeKind::kHealthLost, "no battery and leak data for {:g} s"},
    {FailsafeKind::kRangeLost, "no range data for {:g} s"},
    {FailsafeKind::kEstimatorDiverged, "estimate off in depth by {:g} m"},
    {FailsafeKind::kLocalisationLost, "position too uncertain: {:g} \u03c3 left"},
    {FailsafeKind::kWrongMap, "the map is of another place"},
    {FailsafeKind::kPlannerFailure, "{:g} plans fail in a row"},
    {FailsafeKind::kCommsLost, "topside silent for {:g} s"},
    {FailsafeKind::kOperatorAbort, "abort from topside"},
    {FailsafeKind::kLogLost, "log cannot be written"},
    {FailsafeKind::kRetraceFailure, "the exit path is blocked"},
    {FailsafeKind::kInternalError, "error in the program"},
}};

constexpr bool in_order() {
  for (std::size_t i = 0; i < kFaultWords.size(); ++i) {
    if (kFaultWords[i].kind != static_cast<FailsafeKind>(i)) return false;
  }
  return true;
}
static_assert(in_order());

double limit_of(const Mission& mission, FailsafeKind kind) {
  const double threshold = mission.failsafes.threshold[static_cast<std::size_t>(kind)];
  switch (kind) {
    case FailsafeKind::kBattery:
      return 100.0 * threshold;
    case FailsafeKind::kOverdepth:
      return mission.limits.max_depth.value;
    case FailsafeKind::kMinAltitude:
      return mission.limits.min_altitude.value;
    default:
      return threshold;
  }
}

bool is_possible(const Mission& mission, FailsafeKind kind) {
  if (kind == FailsafeKind::kRangeLost) return uses_range_camera(mission);
  if (kind == FailsafeKind::kWrongMap) return uses_map_fixes(mission) && uses_range_camera(mission);
  return true;
}

// A hold becomes an abort after a while, under an overhead only for lost range data:
// FailsafeLadder. After an error in the program SurfacingFallback acts, whatever the rung.
AbortRow row_of(const FailsafePolicy& policy, FailsafeKind kind) {
  if (kind == FailsafeKind::kInternalError) {
    return {{}, "straight up", "along its exit path to open water, then up"};
  }
  const std::string later = fmt::format("; after {:g} s", policy.escalate_s);
  const std::string holds = "keeps depth and heading (a current carries it)";
  switch (policy.rung) {
    case Rung::kEmergencySurface:
      return {{}, "straight up", "straight up, against the overhead"};
    case Rung::kAbortAndSurface:
      return {{}, "straight up", "back along its trail to open water, then up"};
    case Rung::kRetrace:
      return {
          {}, "waits 1 min, then up", "back along its trail to open water, waits 1 min, then up"};
    case Rung::kHold:
      return {{},
              holds + later + " up",
              kind == FailsafeKind::kRangeLost ? holds + later + " back, then up"
                                               : holds + " until it clears"};
    case Rung::kReplan:
      return {{}, "plans again" + later + " up", "plans again" + later + " back, then up"};
    case Rung::kWarn:
      return {{}, "reports it and goes on", "reports it and goes on"};
    case Rung::kNone:
      return {{}, "not watched", "not watched"};
  }
  return {};
}

// True for an event of a transition ("plan.failed", "done.state.*", "*") that the event matches.
bool matches(std::string_view written, std::string_view event) {
  if (written == "*") return true;
  if (written.ends_with(".*")) written.remove_suffix(2);
  if (!event.starts_with(written)) return false;
  return event.size() == written.size() || event[written.size()] == '.';
}

std::string target_of(const TransitionSpec& transition) {
  return transition.targets.empty() ? "" : transition.targets.front().value;
}

// The state and those that contain it, from the inside.
std::vector<const StateSpec*> chain_of(const std::vector<StateSpec>& states,
                                       const std::string& id) {
  for (const StateSpec& spec : states) {
    if (spec.id.value == id) return {&spec};
    std::vector<const StateSpec*> inner = chain_of(spec.children, id);
    if (inner.empty()) continue;
    inner.push_back(&spec);
    return inner;
  }
  return {};
}

void add_to(std::string& text, const std::string& more) {
  text += text.empty() ? more : "; " + more;
}

void add_transition(const TransitionSpec& transition, StateReaction& reaction) {
  const std::string target = target_of(transition);
  if (target.empty()) return;
  const std::string when = transition.guard ? " if " + transition.guard->text() : "";
  if (transition.events.empty()) {
    add_to(reaction.otherwise, "\u2192 " + target + when);
    return;
  }
  for (const std::string& event : transition.events) {
    if (reaction.without_path.empty() && matches(event, "plan.failed." + reaction.state)) {
      reaction.without_path = "\u2192 " + target + when;
    } else if (event.starts_with("failsafe.")) {
      add_to(reaction.otherwise,
             "\u2192 " + target + " at " + event.substr(event.find('.') + 1) + when);
    }
  }
}

}  // namespace

std::vector<AbortRow> abort_table(const Mission& mission) {
  struct Group {
    Rung rung;
    AbortRow row;
  };
  std::vector<Group> groups;
  for (const FaultWords& fault : kFaultWords) {
    if (!is_possible(mission, fault.kind)) continue;
    const FailsafePolicy& policy = mission.failsafes.policy(fault.kind);
    const AbortRow row = row_of(policy, fault.kind);
    auto group = std::ranges::find_if(groups, [&](const Group& one) {
      return std::tie(one.row.in_open_water, one.row.under_overhead) ==
             std::tie(row.in_open_water, row.under_overhead);
    });
    if (group == groups.end()) group = groups.insert(group, {policy.rung, row});
    group->row.faults.push_back(
        fmt::format(fmt::runtime(fault.words), limit_of(mission, fault.kind)));
  }
  std::ranges::stable_sort(groups, std::ranges::greater(), &Group::rung);
  std::vector<AbortRow> rows;
  for (Group& group : groups) rows.push_back(std::move(group.row));
  return rows;
}

std::vector<StateReaction> state_reactions(const Mission& mission, const CheckReport& report) {
  std::vector<StateReaction> reactions;
  for (const PlannedRouteLeg& leg : report.legs) {
    if (std::ranges::find(reactions, leg.state, &StateReaction::state) != reactions.end()) continue;
    StateReaction& reaction = reactions.emplace_back();
    reaction.state = leg.state;
    for (const StateSpec* spec : chain_of(mission.states, leg.state)) {
      if (spec->timeout && reaction.at_timeout.empty()) {
        reaction.at_timeout = fmt::format("{} \u2192 {}", clock_text(spec->timeout->seconds.value),
                                          spec->timeout->on_timeout.value);
      }
      for (const TransitionSpec& transition : spec->transitions) {
        add_transition(transition, reaction);
      }
    }
  }
  return reactions;
}

}  // namespace dive::mission
