// Rules: the states of a mission form a machine that can be run, with one behaviour at a time.

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "mission/document/rule_set.h"

namespace dive::mission {
namespace {

// The state that is filled by entering a target: for a history, its parent.
int filled_by(const StateIndex& index, int target) {
  return is_history(index.spec(target)) ? index.parent(target) : target;
}

bool in_different_regions(const StateIndex& index, int a, int b) {
  if (index.is_within(a, b) || index.is_within(b, a)) return false;
  int common = index.parent(a);
  while (common >= 0 && !index.is_within(b, common)) common = index.parent(common);
  return common >= 0 && index.spec(common).type == StateType::kParallel;
}

bool has_behavior_inside(const StateSpec& spec) {
  return is_behavior(spec) ||
         std::any_of(spec.children.begin(), spec.children.end(), has_behavior_inside);
}

// Reports every part that leaves the vehicle without a behaviour, or with two.
void demand_steering(const Subject& subject, const StateSpec& spec) {
  if (spec.type == StateType::kAtomic && !is_behavior(spec)) {
    subject.error(
        "MIS-IDLE", spec.id.span,
        fmt::format("'{}' is empty, so no behaviour steers the vehicle in it", spec.id.value),
        "use 'hold' to wait in place");
  }
  if (spec.type == StateType::kCompound) {
    for (const StateSpec& child : spec.children) demand_steering(subject, child);
  }
  if (spec.type != StateType::kParallel) return;
  const StateSpec* steering = nullptr;
  for (const StateSpec& region : spec.children) {
    if (!has_behavior_inside(region)) continue;
    if (steering == nullptr) {
      steering = &region;
      demand_steering(subject, region);
    } else {
      subject.error(
          "MIS-PARALLEL", region.id.span,
          fmt::format("'{}' steers the vehicle while '{}' does ({})", region.id.value,
                      steering->id.value, subject.mission.source.line_name(steering->id.span.line)),
          "only one region of a parallel may hold states that steer");
    }
  }
  if (steering == nullptr) {
    subject.error(
        "MIS-PARALLEL", spec.id.span,
        fmt::format("no region of '{}' steers the vehicle", spec.id.value),
        "one region must hold goto, goal_sequence, transect, hold or another that steers");
  }
}

}  // namespace

void transitions_say_something(const Subject& subject) {
  for (int state = 0; state < subject.index.size(); ++state) {
    for (const TransitionSpec& transition : subject.index.spec(state).transitions) {
      if (transition.events.empty() && transition.targets.empty()) {
        subject.error("MIS-TRANSITION", transition.span,
                      "this transition has neither an event nor a target, so it would be taken "
                      "without end",
                      "give it a target");
      }
    }
  }
}

namespace {

// True if `general` matches every event that `special` matches.
bool covers(std::string general, std::string special) {
  const auto trimmed = [](std::string& descriptor) {
    if (descriptor.ends_with(".*")) descriptor.resize(descriptor.size() - 2);
  };
  trimmed(general);
  trimmed(special);
  return general == "*" || general == special || special.starts_with(general + ".");
}

bool always_before(const TransitionSpec& first, const TransitionSpec& second) {
  if (first.guard) return false;
  if (first.events.empty() || second.events.empty()) {
    return first.events.empty() && second.events.empty();
  }
  return std::all_of(second.events.begin(), second.events.end(), [&](const std::string& event) {
    return std::any_of(first.events.begin(), first.events.end(),
                       [&](const std::string& general) { return covers(general, event); });
  });
}

}  // namespace

void transitions_can_fire(const Subject& subject) {
  for (int state = 0; state < subject.index.size(); ++state) {
    const std::vector<TransitionSpec>& transitions = subject.index.spec(state).transitions;
    for (std::size_t i = 1; i < transitions.size(); ++i) {
      const auto before =
          std::find_if(transitions.begin(), transitions.begin() + static_cast<std::ptrdiff_t>(i),
                       [&](const TransitionSpec& t) { return always_before(t, transitions[i]); });
      if (before == transitions.begin() + static_cast<std::ptrdiff_t>(i)) continue;
      subject.warning("MIS-NEVER-FIRES", transitions[i].span,
                      fmt::format("the transition in {} always comes first",
                                  subject.mission.source.line_name(before->span.line)),
                      "give that one a cond, or write this one before it");
    }
  }
}

void targets_fit_together(const Subject& subject) {
  const StateIndex& index = subject.index;
  for (int state = 0; state < index.size(); ++state) {
    for (const TransitionSpec& transition : index.spec(state).transitions) {
      const auto& targets = transition.targets;
      for (std::size_t i = 1; i < targets.size(); ++i) {
        const int later = index.find(targets[i].value);
        const auto excludes = [&](const Located<std::string>& other) {
          const int earlier = index.find(other.value);
          return earlier >= 0 && later >= 0 &&
                 !in_different_regions(index, filled_by(index, earlier), filled_by(index, later));
        };
        const auto end = targets.begin() + static_cast<std::ptrdiff_t>(i);
        const auto earlier = std::find_if(targets.begin(), end, excludes);
        if (earlier == end) continue;
        subject.error("MIS-TARGETS", targets[i].span,
                      fmt::format("'{}' and '{}' cannot be active together", earlier->value,
                                  targets[i].value),
                      "several targets must be in different regions of one parallel");
      }
    }
  }
}

void histories_remember_their_own(const Subject& subject) {
  const StateIndex& index = subject.index;
  for (int state = 0; state < index.size(); ++state) {
    const StateSpec& spec = index.spec(state);
    if (!is_history(spec)) continue;
    const int target = index.find(spec.initial->value);
    if (target < 0 || !index.is_within(target, index.parent(state))) continue;  // MIS-INITIAL
    if (is_history(index.spec(target))) {
      subject.error("MIS-HISTORY", spec.initial->span,
                    fmt::format("'{}' is a history itself", spec.initial->value));
    } else if (spec.type == StateType::kShallowHistory &&
               index.parent(target) != index.parent(state)) {
      subject.error("MIS-HISTORY", spec.initial->span,
                    fmt::format("'{}' is not a sibling of the shallow history '{}'",
                                spec.initial->value, spec.id.value),
                    "name a sibling, or use type=\"deep\"");
    }
  }
}

void someone_steers(const Subject& subject) {
  for (int state = 0; state < subject.index.size(); ++state) {
    const StateSpec& spec = subject.index.spec(state);
    if (spec.type == StateType::kCompound &&
        std::all_of(spec.children.begin(), spec.children.end(), is_history)) {
      subject.error("MIS-IDLE", spec.id.span,
                    fmt::format("'{}' has no state inside, only history", spec.id.value));
    }
  }
  for (const StateSpec& spec : subject.mission.states) demand_steering(subject, spec);
}

}  // namespace dive::mission
