// Random missions, run by the statechart interpreter with random guards and events: nothing happens
// that the flow analysis excludes.

#include "mission/executive/machine.h"

#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "mission/document/flow.h"
#include "mission/document/reader.h"
#include "mission/document/rules.h"
#include "mission/document/state_index.h"
#include "mission/statechart/interpreter.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {
namespace {

int pick(int below) { return *rc::gen::inRange(0, below); }

// Writes states with consecutive names first, then adds transitions between them.
class MissionWriter {
 public:
  std::string write() {
    std::string states;
    const int count = 2 + pick(4);
    for (int i = 0; i < count; ++i) states += state(2, true);
    states += "<final id=\"" + name("f") + "\"/>";
    std::string text =
        "<mission xmlns=\"urn:dive:mission:1\" id=\"m\"><vehicle model=\"aqua2\" speed=\"0.4\"/>"
        "<map file=\"m.sdf\"/><start x=\"0\" y=\"0\" z=\"1\" z_units=\"DEPTH\" heading_deg=\"0\"/>"
        "<limits max_depth=\"9\" min_altitude=\"0\" clearance=\"1\" mission_timeout=\"900\" "
        "battery_reserve=\"0\"/><states initial=\"s0\">" +
        states + "</states></mission>";
    for (std::size_t at = text.find('@'); at != std::string::npos; at = text.find('@', at)) {
      // Every fourth transition leads to the end, so that many missions do end.
      const int target =
          pick(4) == 0 ? static_cast<int>(all_.size()) - 1 : pick(static_cast<int>(all_.size()));
      text.replace(at, 1, all_.at(static_cast<std::size_t>(target)));
    }
    return text;
  }

 private:
  std::string name(const char* prefix) {
    all_.push_back(prefix + std::to_string(all_.size()));
    return all_.back();
  }

  // '@' is replaced by the name of a random state.
  static std::string transitions(const std::string& id) {
    static const std::vector<std::string> kEvents = {"done.state.", "done.state.", "done.state.",
                                                     "timeout.", "plan.failed."};
    std::string text;
    for (int i = pick(3); i > 0; --i) {
      const int kind = pick(10);
      const std::string event = kind < 5    ? kEvents[static_cast<std::size_t>(kind)] + id
                                : kind == 5 ? "done.state.@"
                                : kind == 6 ? "abort"
                                : kind == 7 ? "failsafe.leak timeout.*"
                                : kind == 8 ? "*"
                                            : "";
      text += event.empty() ? "<transition cond=\"depth > 1\" target=\"@\"/>"
                            : "<transition event=\"" + event + "\" target=\"@\"/>";
    }
    return text;
  }

  std::string state(int depth, bool final_allowed) {
    const int kind = pick(depth > 0 ? 8 : 4);
    const std::string id = name("s");
    const std::string open = " id=\"" + id + "\"";
    if (kind == 0) return "<surface" + open + ">" + transitions(id) + "</surface>";
    if (kind == 1) {
      return "<goto" + open +
             " x=\"0\" y=\"0\" z=\"1\" z_units=\"DEPTH\" timeout=\"9\" "
             "on_timeout=\"@\">" +
             transitions(id) + "</goto>";
    }
    if (kind < 4) return "<hold" + open + " duration=\"1\">" + transitions(id) + "</hold>";
    const bool is_parallel = kind == 4;
    std::string inside;
    const std::size_t first = all_.size();
    for (int i = 1 + pick(3); i > 0; --i) inside += state(depth - 1, !is_parallel);
    const std::string first_inside = all_[first];
    if (pick(3) == 0) {
      inside += "<history id=\"" + name("h") + "\" initial=\"" + first_inside + "\"/>";
    }
    if (!is_parallel && final_allowed) inside += "<final id=\"" + name("f") + "\"/>";
    const std::string element = is_parallel ? "parallel" : "state";
    return "<" + element + open + ">" + inside + transitions(id) + "</" + element + ">";
  }

  std::vector<std::string> all_;
};

Mission read(const std::string& text) {
  Diagnostics diagnostics;
  std::optional<XmlDocument> document =
      parse_xml(SourceText("m.xml", text), XmlLimits{}, diagnostics);
  RC_ASSERT(document.has_value());
  return read_mission(std::move(*document), Language(mission_schema()), diagnostics);
}

// Evaluates guards at random, and records every state that was ever entered.
class Recorder final : public statechart::Environment {
 public:
  bool evaluate(statechart::GuardId) override { return pick(4) == 0; }
  void execute(statechart::ActionId) override {}
  void entered(statechart::StateId state) override { entered_.insert(state); }
  void exited(statechart::StateId) override {}
  void taken(int, const std::string&) override {}

  [[nodiscard]] const std::set<statechart::StateId>& ever() const { return entered_; }

 private:
  std::set<statechart::StateId> entered_;
};

// A random event that one of the active atomic states may raise now.
std::string some_event(const Machine& machine, const statechart::Interpreter& interpreter,
                       bool with_emergencies) {
  std::vector<std::string> events;
  if (with_emergencies) events = {"abort", "failsafe.leak"};
  for (const statechart::StateId state : interpreter.configuration()) {
    const StateSpec* spec = machine.specs[static_cast<std::size_t>(state)];
    if (spec == nullptr || !is_behavior(*spec)) continue;
    events.push_back("done.state." + spec->id.value);
    if (is_planning(*spec)) events.push_back("plan.failed." + spec->id.value);
    if (state_timeout(*spec) != nullptr) events.push_back("timeout." + spec->id.value);
  }
  if (events.empty()) return "nothing";
  return events[static_cast<std::size_t>(pick(static_cast<int>(events.size())))];
}

void knows_every_state_that_is_ever_entered() {
  const std::string text = MissionWriter().write();
  const Mission mission = read(text);
  const StateIndex index(mission);
  const Flow flow(mission, index);
  const Machine machine = build_machine(mission);
  Recorder recorder;
  statechart::Interpreter interpreter(machine.chart, recorder);
  interpreter.start();
  for (int i = 0; i < 30 && interpreter.running(); ++i) {
    interpreter.dispatch(some_event(machine, interpreter, true));
    interpreter.settle();
  }
  for (const statechart::StateId state : recorder.ever()) {
    const StateSpec* spec = machine.specs[static_cast<std::size_t>(state)];
    if (spec == nullptr) continue;
    RC_LOG(spec->id.value + " in " + text);
    RC_ASSERT(flow.entered(index.find(spec->id.value)));
  }
}

void knows_how_a_mission_may_end() {
  const std::string text = MissionWriter().write();
  const Mission mission = read(text);
  const StateIndex index(mission);
  const Flow flow(mission, index);
  const Machine machine = build_machine(mission);
  Recorder recorder;
  statechart::Interpreter interpreter(machine.chart, recorder);
  interpreter.start();
  for (int i = 0; i < 40 && interpreter.running(); ++i) {
    interpreter.dispatch(some_event(machine, interpreter, false));
    interpreter.settle();
  }
  const std::vector<bool> ends = flow.ends();
  std::vector<bool> surfacing(ends.size(), false);
  bool ended = false;
  bool surfaced = false;
  for (const statechart::StateId state : recorder.ever()) {
    const StateSpec* spec = machine.specs[static_cast<std::size_t>(state)];
    if (spec == nullptr) continue;
    ended |= ends[static_cast<std::size_t>(index.find(spec->id.value))];
    surfaced |= spec->atomic && spec->atomic->end() == AtomicState::End::kAtTheSurface;
  }
  if (!ended) return;
  for (int state = 0; state < index.size(); ++state) {
    surfacing[static_cast<std::size_t>(state)] = is_surfacing(index.spec(state));
  }
  const auto any_end_in = [&](const std::vector<bool>& states) {
    bool any = false;
    for (std::size_t i = 0; i < ends.size(); ++i) any |= ends[i] && states[i];
    return any;
  };
  RC_LOG(text);
  const std::vector<bool> can_end = flow.can_reach(ends);
  bool first_can = false;
  for (const int state : flow.first()) first_can |= can_end[static_cast<std::size_t>(state)];
  RC_ASSERT(first_can);
  RC_ASSERT(any_end_in(flow.reached_without(std::vector<bool>(ends.size(), false))));
  if (!surfaced) RC_ASSERT(any_end_in(flow.reached_without(surfacing)));
}

void gives_way_to_the_executive() {
  const std::string text = MissionWriter().write();
  const Mission mission = read(text);
  const Machine machine = build_machine(mission);
  Recorder recorder;
  statechart::Interpreter interpreter(machine.chart, recorder);
  interpreter.start();
  for (int i = pick(10); i > 0 && interpreter.running(); --i) {
    interpreter.dispatch(some_event(machine, interpreter, true));
    interpreter.settle();
  }
  if (!interpreter.running()) return;
  const std::vector<std::string> events{"dive.retrace", "dive.abort_and_surface",
                                        "dive.emergency_surface"};
  interpreter.dispatch(events[static_cast<std::size_t>(pick(3))]);
  RC_LOG(text);
  for (const statechart::StateId state : interpreter.configuration()) {
    RC_ASSERT(machine.is_own(state));
  }
}

// Defects that need a history inside a parallel occur in few missions.
constexpr int kMissionsPerCase = 20;

RC_GTEST_PROP(Flow, KnowsEveryStateThatIsEverEntered, ()) {
  for (int i = 0; i < kMissionsPerCase; ++i) knows_every_state_that_is_ever_entered();
}

RC_GTEST_PROP(Flow, KnowsHowAMissionMayEnd, ()) {
  for (int i = 0; i < kMissionsPerCase; ++i) knows_how_a_mission_may_end();
}

// No mission can block an abort, by "*" or otherwise.
RC_GTEST_PROP(Machine, GivesWayToTheExecutive, ()) {
  for (int i = 0; i < kMissionsPerCase; ++i) gives_way_to_the_executive();
}

// The executive requires a chart that can be interpreted: every mission that passes the name and
// structure rules gives one.
RC_GTEST_PROP(CheckedMission, MakesAMachine, ()) {
  std::string text = MissionWriter().write();
  // Occasionally a name in a wrong place.
  for (int i = pick(3); i > 0; --i) {
    const std::size_t quote =
        text.find("=\"s", static_cast<std::size_t>(pick(static_cast<int>(text.size()))));
    if (quote != std::string::npos) text[quote + 3] = static_cast<char>('0' + pick(8));
  }
  const Mission mission = read(text);
  Diagnostics diagnostics;
  check_rules(mission, diagnostics);
  RC_LOG(text);
  bool names_are_right = true;
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    for (const char* code : {"MIS-ID-DUPLICATE", "MIS-INITIAL", "MIS-TARGET", "MIS-TIMEOUT",
                             "MIS-TRANSITION", "MIS-TARGETS", "MIS-HISTORY", "MIS-IDLE"}) {
      names_are_right &= diagnostic.code != code;
    }
  }
  RC_CLASSIFY(names_are_right);
  if (!names_are_right) return;
  const Machine machine = build_machine(mission);
  RC_ASSERT(machine.chart.validate().empty());
}

}  // namespace
}  // namespace dive::mission
