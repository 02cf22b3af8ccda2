#pragma once
// Charts for tests, written in one line, and an environment that records all calls.
//
// Notation: a  atomic; a(...)  compound; a[...]  parallel; a!  final; a~  shallow history; a~~
// deep history. The first child that is not a history is the initial state unless initial() sets
// another.

#include <cctype>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "mission/statechart/interpreter.h"

namespace dive::statechart::testing {

class Draft {
 public:
  explicit Draft(std::string_view drawing) : rest_(drawing) { read_states(-1); }

  /// Targets are ids separated by blanks.
  Draft& initial(const std::string& state, const std::string& targets,
                 std::vector<ActionId> actions = {}) {
    const StateId s = chart.find(state);
    State& node = chart.states.at(static_cast<std::size_t>(s));
    if (node.initial < 0) chart.set_initial(s, {});
    Transition& t = chart.transitions.at(static_cast<std::size_t>(node.initial));
    t.targets = find_all(targets);
    t.actions = std::move(actions);
    return *this;
  }
  Draft& on(const std::string& source, const std::string& events, const std::string& targets,
            std::vector<ActionId> actions = {}) {
    Transition t;
    t.source = chart.find(source);
    t.events = split(events);
    t.targets = find_all(targets);
    t.actions = std::move(actions);
    chart.add_transition(std::move(t));
    return *this;
  }
  /// Sets the guard of the transition added last.
  Draft& when(GuardId guard) {
    chart.transitions.back().guard = guard;
    return *this;
  }
  Draft& internal() {
    chart.transitions.back().internal = true;
    return *this;
  }
  Draft& actions(const std::string& state, std::vector<ActionId> entry,
                 std::vector<ActionId> exit = {}) {
    State& s = chart.states.at(static_cast<std::size_t>(chart.find(state)));
    s.on_entry = std::move(entry);
    s.on_exit = std::move(exit);
    return *this;
  }

  Chart chart;

 private:
  static std::vector<std::string> split(const std::string& text) {
    std::istringstream words(text);
    std::vector<std::string> found;
    for (std::string word; words >> word;) found.push_back(word);
    return found;
  }
  std::vector<StateId> find_all(const std::string& ids) const {
    std::vector<StateId> found;
    for (const std::string& id : split(ids)) found.push_back(chart.find(id));
    return found;
  }
  bool take(std::string_view mark) {
    if (!rest_.starts_with(mark)) return false;
    rest_.remove_prefix(mark.size());
    return true;
  }
  void read_states(StateId parent) {
    while (take(" ")) {
    }
    while (!rest_.empty() && (std::isalnum(static_cast<unsigned char>(rest_[0])) != 0)) {
      read_state(parent);
      while (take(" ")) {
      }
    }
  }
  void read_state(StateId parent) {
    std::size_t length = 0;
    while (length < rest_.size() &&
           (std::isalnum(static_cast<unsigned char>(rest_[length])) != 0)) {
      ++length;
    }
    const std::string id(rest_.substr(0, length));
    rest_.remove_prefix(length);
    if (take("~~")) {
      chart.add_state(id, StateKind::kDeepHistory, parent);
    } else if (take("~")) {
      chart.add_state(id, StateKind::kShallowHistory, parent);
    } else if (take("!")) {
      chart.add_state(id, StateKind::kFinal, parent);
    } else if (take("[")) {
      read_states(chart.add_state(id, StateKind::kParallel, parent));
      take("]");
    } else if (take("(")) {
      const StateId state = chart.add_state(id, StateKind::kCompound, parent);
      read_states(state);
      take(")");
      set_first_child_initial(state);
    } else {
      chart.add_state(id, StateKind::kAtomic, parent);
    }
  }
  void set_first_child_initial(StateId state) {
    for (const StateId child : chart.states.at(static_cast<std::size_t>(state)).children) {
      const StateKind kind = chart.states.at(static_cast<std::size_t>(child)).kind;
      if (kind == StateKind::kShallowHistory || kind == StateKind::kDeepHistory) continue;
      chart.set_initial(state, {child});
      return;
    }
  }

  std::string_view rest_;
};

/// Writes "+a" for entered, "-a" for exited, "#7" for action 7, "t2:event" for a transition taken.
class Recorder : public Environment {
 public:
  explicit Recorder(const Chart& chart) : chart_(chart) {}

  bool evaluate(GuardId guard) override { return guards.at(guard)(); }
  void execute(ActionId action) override {
    note(fmt::format("#{}", action));
    if (const auto found = on_action.find(action); found != on_action.end()) found->second();
  }
  void entered(StateId state) override {
    note(fmt::format("+{}", id(state)));
    if (const auto found = on_entered.find(id(state)); found != on_entered.end()) found->second();
  }
  void exited(StateId state) override { note(fmt::format("-{}", id(state))); }
  void taken(int transition, const std::string& event) override {
    if (note_taken) note(fmt::format("t{}:{}", transition, event));
  }

  /// The calls since the last call of this function.
  std::string record() { return std::exchange(record_, {}); }

  std::map<GuardId, std::function<bool()>> guards;
  std::map<ActionId, std::function<void()>> on_action;
  std::map<std::string, std::function<void()>> on_entered;
  bool note_taken = false;

 private:
  const std::string& id(StateId state) const {
    return chart_.states.at(static_cast<std::size_t>(state)).id;
  }
  void note(const std::string& what) {
    if (!record_.empty()) record_ += ' ';
    record_ += what;
  }

  const Chart& chart_;
  std::string record_;
};

/// A chart, its interpreter and its recorder.
struct Machine {
  explicit Machine(Draft draft)
      : chart(std::move(draft.chart)), recorder(chart), interpreter(chart, recorder) {}

  std::string start() {
    interpreter.start();
    return recorder.record();
  }
  std::string dispatch(const std::string& event) {
    interpreter.dispatch(event);
    return recorder.record();
  }
  std::string active() const {
    std::string ids;
    for (const StateId s : interpreter.configuration()) {
      if (!ids.empty()) ids += ' ';
      ids += chart.states.at(static_cast<std::size_t>(s)).id;
    }
    return ids;
  }

  Chart chart;
  Recorder recorder;
  Interpreter interpreter;
};

}  // namespace dive::statechart::testing
