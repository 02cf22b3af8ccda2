#include "mission/states/wreck_penetration.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/document/state_reader.h"
#include "mission/states/goal_sequence.h"
#include "mission/states/goto.h"
#include "mission/states/retrace.h"

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

// The part is what an element of its own would be.
StateSpec part(const StateSpec& whole, const char* name,
               std::shared_ptr<const AtomicState> atomic) {
  StateSpec spec;
  spec.element = whole.element;
  spec.is_generated = true;
  spec.id = {fmt::format("{}-{}", whole.id.value, name), whole.id.span};
  spec.atomic = std::move(atomic);
  spec.overhead = true;
  return spec;
}

std::shared_ptr<const AtomicState> go_to(const StateReader& reader, const XmlElement& waypoint,
                                         std::string id) {
  Goal goal = reader.goal(waypoint);
  goal.id = {std::move(id), waypoint.span};
  return std::make_shared<GotoState>(std::move(goal));
}

TransitionSpec turn_back(const AttributeReader& attributes, const XmlElement& element,
                         std::string target) {
  TransitionSpec spec = leads({}, std::move(target), element.span);
  const std::string cond = fmt::format("penetration > {} m or budget_used > {}",
                                       attributes.number(element, "max_penetration").value,
                                       attributes.number(element, "turn_back").value);
  Guard::Error error;
  spec.guard = Guard::parse(cond, error);
  DIVE_DEMAND(spec.guard);
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
void read_wreck_penetration(const XmlElement& element, const StateReader& reader,
                            StateSpec& whole) {
  const auto id_of = [&whole](const char* name) {
    return fmt::format("{}-{}", whole.id.value, name);
  };
  const XmlElement& entry = *element.child("entry");
  const XmlElement* exit = element.child("exit");
  const Span span = element.span;

  whole.type = StateType::kCompound;
  whole.initial = {id_of("entry"), whole.id.span};
  whole.overhead = false;  // the entry is in open water
  const std::optional<ReplanPolicy> replan = std::exchange(whole.replan, std::nullopt);

  StateSpec in = part(whole, "entry", go_to(reader, entry, id_of("entry")));
  in.overhead = false;
  in.transitions = {leads({"done.state." + in.id.value}, id_of("inside"), span),
                    leads({"plan.failed." + in.id.value}, {}, span)};
  // Reported outside as a penetration that cannot be started.
  in.transitions.back().actions = {
      {ActionSpec::Kind::kRaise, {"plan.failed." + whole.id.value, span}, false}};

  StateSpec inside =
      part(whole, "inside", std::make_shared<GoalSequenceState>(reader.goals_in(element)));
  inside.transitions = {leads({"done.state." + inside.id.value, "plan.failed." + inside.id.value},
                              id_of("exit"), span),
                        turn_back(reader.attributes(), element, id_of("exit"))};

  StateSpec out =
      part(whole, "exit", go_to(reader, exit != nullptr ? *exit : entry, id_of("exit")));
  out.transitions = {leads({"done.state." + out.id.value}, id_of("out"), span),
                     leads({"plan.failed." + out.id.value}, id_of("retrace"), span)};

  StateSpec back = part(whole, "retrace", std::make_shared<RetraceState>());
  back.transitions = {leads({"done.state." + back.id.value}, id_of("out"), span)};

  StateSpec end = part(whole, "out", nullptr);
  end.type = StateType::kFinal;
  end.overhead = false;

  for (StateSpec* planning : {&in, &inside, &out}) planning->replan = replan;
  whole.children = {std::move(in), std::move(inside), std::move(out), std::move(back),
                    std::move(end)};
}

}  // namespace dive::mission
