#include "mission/document/state_reader.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/document/source_place.h"
#include "mission/document/state_index.h"
#include "mission/states/state_elements.h"

namespace dive::mission {
namespace {

std::optional<Located<std::string>> first_inside(const StateSpec& spec) {
  for (const StateSpec& child : spec.children) {
    if (!is_history(child)) return Located<std::string>{child.id.value, spec.id.span};
  }
  return std::nullopt;
}

bool is_state(const XmlElement& element) {
  constexpr std::string_view kStructure[] = {"state", "parallel", "history", "final"};
  return find_state_element(element.name) != nullptr ||
         std::ranges::find(kStructure, element.name) != std::end(kStructure);
}

}  // namespace

StateSpec StateReader::state(const XmlElement& element, bool overhead_above) {
  StateSpec spec;
  spec.element = element.name;
  spec.id = attributes_.name(element, "id");
  spec.overhead = overhead_above || (element.attribute("overhead") != nullptr &&
                                     attributes_.flag(element, "overhead"));
  read_content(element, spec);
  if (const StateElement* own = find_state_element(element.name)) {
    own->read(element, *this, spec);
    return spec;
  }
  set_type(element, spec);
  for (const XmlElement& child : element.children) {
    if (is_state(child)) spec.children.push_back(state(child, spec.overhead));
  }
  // A state without children is atomic: it monitors and steers nothing.
  if (spec.type == StateType::kCompound && spec.children.empty()) spec.type = StateType::kAtomic;
  if (element.attribute("initial") != nullptr) {
    spec.initial = attributes_.name(element, "initial");
  } else if (spec.type == StateType::kCompound) {
    spec.initial = first_inside(spec);
  }
  return spec;
}

void StateReader::read_content(const XmlElement& element, StateSpec& spec) {
  const auto append = [](std::vector<ActionSpec>& to, std::vector<ActionSpec> more) {
    to.insert(to.end(), more.begin(), more.end());
  };
  spec.timeout = timeout(element);
  for (const XmlElement& child : element.children) {
    if (child.name == "transition") spec.transitions.push_back(transition(child));
    if (child.name == "onentry") append(spec.on_entry, actions(child));
    if (child.name == "onexit") append(spec.on_exit, actions(child));
    if (child.name == "replan") spec.replan = attributes_.replan(child);
  }
}

void StateReader::set_type(const XmlElement& element, StateSpec& spec) const {
  if (element.name == "history") {
    spec.type = attributes_.name(element, "type").value == "deep" ? StateType::kDeepHistory
                                                                  : StateType::kShallowHistory;
  } else if (element.name == "final") {
    spec.type = StateType::kFinal;
  } else if (element.name == "parallel") {
    spec.type = StateType::kParallel;
  } else {
    DIVE_DEMAND(element.name == "state");  // all others are in the table
    spec.type = StateType::kCompound;
  }
}

std::vector<Goal> StateReader::goals_in(const XmlElement& element) const {
  std::vector<Goal> goals;
  for (const XmlElement& child : element.children) {
    if (child.name == "goal") goals.push_back(goal(child));
  }
  return goals;
}

Goal StateReader::goal(const XmlElement& element) const {
  Goal goal;
  if (element.attribute("id") != nullptr) goal.id = attributes_.name(element, "id");
  goal.position = attributes_.position(element);
  goal.heading_deg = attributes_.optional_number(element, "heading_deg");
  goal.capture_radius = attributes_.number(element, "capture_radius");
  goal.dwell_s =
      attributes_.optional_number(element, "dwell").value_or(Located<double>{0.0, element.span});
  goal.reduced_clearance = attributes_.optional_number(element, "reduced_clearance");
  goal.span = element.span;
  return goal;
}

std::optional<Timeout> StateReader::timeout(const XmlElement& element) {
  const auto seconds = attributes_.optional_number(element, "timeout");
  if (!seconds) {
    if (const XmlAttribute* alone = element.attribute("on_timeout")) {
      diagnostics_.error("MIS-TIMEOUT", attributes_.source(), alone->name_span,
                         fmt::format("'{}' has an on_timeout but no timeout", element.name));
    }
    return std::nullopt;
  }
  Timeout timeout{*seconds, {{}, seconds->span}};  // rules.h reports a missing on_timeout
  if (element.attribute("on_timeout") != nullptr) {
    timeout.on_timeout = attributes_.name(element, "on_timeout");
  }
  return timeout;
}

TransitionSpec StateReader::transition(const XmlElement& element) {
  TransitionSpec spec;
  spec.span = element.span;
  spec.internal = attributes_.name(element, "type").value == "internal";
  spec.actions = actions(element);
  if (const XmlAttribute* event = element.attribute("event")) {
    for (Located<std::string>& word : attributes_.words(*event)) {
      spec.events.push_back(std::move(word.value));
      spec.event_spans.push_back(word.span);
    }
  }
  if (const XmlAttribute* target = element.attribute("target")) {
    spec.targets = attributes_.words(*target);
  }
  if (const XmlAttribute* cond = element.attribute("cond")) spec.guard = guard(*cond);
  return spec;
}

std::optional<Guard> StateReader::guard(const XmlAttribute& cond) {
  Guard::Error error;
  std::optional<Guard> guard = Guard::parse(cond.value, error);
  if (!guard) {
    diagnostics_.error("MIS-COND", attributes_.source(),
                       span_in_value(attributes_.source(), cond, error.offset, 1), error.message,
                       error.hint);
  }
  return guard;
}

std::vector<ActionSpec> StateReader::actions(const XmlElement& element) const {
  std::vector<ActionSpec> actions;
  for (const XmlElement& child : element.children) {
    if (child.name == "log") {
      actions.push_back({ActionSpec::Kind::kLog, attributes_.text(child, "message"), false});
    } else if (child.name == "raise") {
      actions.push_back({ActionSpec::Kind::kRaise, attributes_.name(child, "event"), false});
    } else if (child.name == "payload") {
      actions.push_back({ActionSpec::Kind::kPayload, attributes_.name(child, "command"),
                         attributes_.flag(child, "once")});
    }
  }
  return actions;
}

}  // namespace dive::mission
