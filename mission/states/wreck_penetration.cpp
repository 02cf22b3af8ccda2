// <wreck_penetration>: in and out again, read as a compound state with one child state per part.

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/document/state_reader.h"

namespace dive::mission {
namespace {

TransitionSpec leads(std::vector<std::string> events, std::string target, Span span) {
  TransitionSpec spec;
  spec.span = span;
  spec.event_spans.assign(events.size(), span);
  spec.events = std::move(events);
  if (!target.empty()) spec.targets = {{std::move(target), span}};
  return spec;
}

}  // namespace

//   ID            compound, timeout
//     ID-entry    goto, in open water
//     ID-inside   goal_sequence; exits to ID-exit when done, failed, or past a limit of distance or
//                 budget
//     ID-exit     goto; if no path is found, ID-retrace
//     ID-retrace  retrace
//     ID-out      final
StateSpec StateReader::penetration(const XmlElement& element) {
  const Located<std::string> id = attributes_.name(element, "id");
  const auto part = [&id](const char* name) { return fmt::format("{}-{}", id.value, name); };
  const XmlElement& entry = *element.child("entry");
  const XmlElement* exit = element.child("exit");
  const Span span = element.span;

  StateSpec whole;
  whole.element = element.name;
  whole.id = id;
  whole.type = StateType::kCompound;
  whole.initial = {part("entry"), id.span};
  read_content(element, whole);
  const std::optional<ReplanPolicy> replan = std::exchange(whole.replan, std::nullopt);

  StateSpec in =
      penetration_part(element, "entry", GotoState{penetration_waypoint(element, entry, "entry")});
  in.overhead = false;
  in.transitions = {leads({"done.state." + in.id.value}, part("inside"), span),
                    leads({"plan.failed." + in.id.value}, {}, span)};
  // Reported outside as a penetration that cannot be started.
  in.transitions.back().actions = {
      {ActionSpec::Kind::kRaise, {"plan.failed." + id.value, span}, false}};

  GoalSequenceState goals;
  for (const XmlElement& child : element.children) {
    if (child.name == "goal") goals.goals.push_back(goal(child));
  }
  StateSpec inside = penetration_part(element, "inside", std::move(goals));
  inside.transitions = {leads({"done.state." + inside.id.value, "plan.failed." + inside.id.value},
                              part("exit"), span),
                        turn_back(element)};

  StateSpec out = penetration_part(
      element, "exit",
      GotoState{penetration_waypoint(element, exit != nullptr ? *exit : entry, "exit")});
  out.transitions = {leads({"done.state." + out.id.value}, part("out"), span),
                     leads({"plan.failed." + out.id.value}, part("retrace"), span)};

  StateSpec back = penetration_part(element, "retrace", RetraceState{});
  back.transitions = {leads({"done.state." + back.id.value}, part("out"), span)};

  StateSpec end = penetration_part(element, "out", std::monostate{});
  end.type = StateType::kFinal;
  end.overhead = false;

  for (StateSpec* planning : {&in, &inside, &out}) planning->replan = replan;
  whole.children = {std::move(in), std::move(inside), std::move(out), std::move(back),
                    std::move(end)};
  return whole;
}

StateSpec StateReader::penetration_part(const XmlElement& element, const char* part,
                                        Leaf leaf) const {
  const Located<std::string> id = attributes_.name(element, "id");
  StateSpec spec;
  spec.element = element.name;
  spec.id = {fmt::format("{}-{}", id.value, part), id.span};
  spec.leaf = std::move(leaf);
  spec.overhead = true;
  return spec;
}

Goal StateReader::penetration_waypoint(const XmlElement& element, const XmlElement& waypoint,
                                       const char* part) const {
  Goal result = goal(waypoint);
  result.id = {fmt::format("{}-{}", attributes_.name(element, "id").value, part), waypoint.span};
  return result;
}

TransitionSpec StateReader::turn_back(const XmlElement& element) const {
  TransitionSpec spec =
      leads({}, fmt::format("{}-exit", attributes_.name(element, "id").value), element.span);
  const std::string cond = fmt::format("penetration > {} m or spent > {}",
                                       attributes_.number(element, "max_penetration").value,
                                       attributes_.number(element, "turn_back").value);
  Guard::Error error;
  spec.guard = Guard::parse(cond, error);
  DIVE_DEMAND(spec.guard);
  return spec;
}

}  // namespace dive::mission
