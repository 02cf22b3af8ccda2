// For any chart and any events: the interpreter makes the same callbacks as the recommendation's
// algorithm, and every stable configuration is legal.

#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "common/random.h"
#include "mission/statechart/interpreter.h"
#include "test/mission/statechart/draft.h"
#include "test/mission/statechart/reference_interpreter.h"

namespace dive::statechart::testing {
namespace {

/// Decisions read from a list of numbers; after its end all further ones are 0, so that a shorter
/// list gives a smaller chart.
class Tape {
 public:
  explicit Tape(std::vector<int> numbers) : numbers_(std::move(numbers)) {}
  int below(int limit) {
    const int number = position_ < numbers_.size() ? numbers_[position_++] : 0;
    return limit <= 0 ? 0 : number % limit;
  }

 private:
  std::vector<int> numbers_;
  std::size_t position_ = 0;
};

class ChartMaker {
 public:
  explicit ChartMaker(std::vector<int> numbers) : tape_(std::move(numbers)) {}

  Chart make() {
    add_children(chart_.add_state("m", StateKind::kCompound, -1), 0);
    for (StateId s = 0; s < count(); ++s) set_initial(s);
    const int wanted = 2 + tape_.below(3 * count());
    for (int i = 0; i < wanted; ++i) add_transition();
    return chart_;
  }

 private:
  static constexpr int kMaxStates = 24;

  StateId count() const { return static_cast<StateId>(chart_.states.size()); }
  State& state(StateId s) { return chart_.states.at(static_cast<std::size_t>(s)); }

  StateId add(StateKind kind, StateId parent) {
    const StateId s = chart_.add_state(fmt::format("s{}", count()), kind, parent);
    const bool history = kind == StateKind::kShallowHistory || kind == StateKind::kDeepHistory;
    if (!history && tape_.below(3) == 0) state(s).on_entry = {100 + s};
    if (!history && tape_.below(3) == 0) state(s).on_exit = {200 + s};
    return s;
  }

  void add_children(StateId parent, int depth) {
    const bool parallel = state(parent).kind == StateKind::kParallel;
    if (parent != 0 && tape_.below(3) == 1) {
      add(tape_.below(2) == 0 ? StateKind::kShallowHistory : StateKind::kDeepHistory, parent);
    }
    const int wanted = 1 + tape_.below(3);
    for (int i = 0; i < wanted; ++i) {
      const int choice = tape_.below(7);
      const bool full = depth > 3 || count() > kMaxStates;
      if (!full && (choice == 3 || choice == 4)) {
        add_children(add(StateKind::kCompound, parent), depth + 1);
      } else if (!full && choice == 5) {
        add_children(add(StateKind::kParallel, parent), depth + 1);
      } else {
        add(choice == 6 && !parallel ? StateKind::kFinal : StateKind::kAtomic, parent);
      }
    }
  }

  void set_initial(StateId s) {
    const StateKind kind = state(s).kind;
    const bool history = kind == StateKind::kShallowHistory || kind == StateKind::kDeepHistory;
    if (!history && kind != StateKind::kCompound) return;
    const StateId owner = history ? state(s).parent : s;
    std::vector<StateId> candidates;
    for (StateId c = 0; c < count(); ++c) {
      const bool is_target =
          state(c).kind != StateKind::kShallowHistory && state(c).kind != StateKind::kDeepHistory;
      const bool near_enough = kind == StateKind::kShallowHistory || tape_.below(2) == 0
                                   ? state(c).parent == owner
                                   : chart_.is_descendant(c, owner);
      if (is_target && near_enough) candidates.push_back(c);
    }
    if (candidates.empty()) candidates.push_back(first_state_below(owner));
    const int pick = tape_.below(static_cast<int>(candidates.size()));
    const int t = chart_.set_initial(s, {candidates.at(static_cast<std::size_t>(pick))});
    if (tape_.below(3) == 0) chart_.transitions.at(static_cast<std::size_t>(t)).actions = {300 + s};
  }

  StateId first_state_below(StateId owner) {
    for (const StateId c : state(owner).children) {
      if (state(c).kind != StateKind::kShallowHistory && state(c).kind != StateKind::kDeepHistory) {
        return c;
      }
    }
    return -1;
  }

  /// Adds a random transition; removes it if it would make the chart invalid.
  void add_transition() {
    static const std::vector<std::vector<std::string>> kEvents = {
        {"e"}, {"f"}, {"e.x", "f"}, {"*"}, {"done.state"}, {"g.*"}, {}};
    Transition t;
    t.source = 1 + tape_.below(count() - 1);
    t.events = kEvents.at(static_cast<std::size_t>(tape_.below(static_cast<int>(kEvents.size()))));
    t.guard = tape_.below(4) == 0 || t.events.empty() ? tape_.below(4) : -1;
    const int targets = tape_.below(4);
    for (int i = 0; i < targets; ++i) {
      const StateId target = 1 + tape_.below(count() - 1);
      t.targets.push_back(target);
      // Most pairs exclude each other: this one is kept only if the chart allows it.
      if (i > 0 && !can_target(t)) t.targets.pop_back();
    }
    t.internal = tape_.below(3) == 0;
    t.actions = {400 + static_cast<int>(chart_.transitions.size())};
    const Chart before = chart_;
    chart_.add_transition(std::move(t));
    if (!chart_.validate().empty()) chart_ = before;
  }

  bool can_target(const Transition& t) const {
    Chart trial = chart_;
    trial.add_transition(t);
    return trial.validate().empty();
  }

  Tape tape_;
  Chart chart_;
};

/// Guards depend on the number of calls so far, and some actions and atomic states raise events.
class World : public Recorder {
 public:
  World(const Chart& chart, std::function<void(std::string)> raise)
      : Recorder(chart), chart_(chart), raise_(std::move(raise)) {
    note_taken = true;
  }

  bool evaluate(GuardId guard) override { return (happened_ * 7 + guard * 5) % 3 != 0; }
  void execute(ActionId action) override {
    ++happened_;
    Recorder::execute(action);
    if (action % 5 == 0) raise_(action % 2 == 0 ? "e.x" : "g");
  }
  void entered(StateId s) override {
    ++happened_;
    Recorder::entered(s);
    const State& entered_state = chart_.states.at(static_cast<std::size_t>(s));
    if (entered_state.kind == StateKind::kAtomic && s % 4 == 0) {
      raise_("done.state." + entered_state.id);
    }
  }

 private:
  const Chart& chart_;
  std::function<void(std::string)> raise_;
  int happened_ = 0;
};

/// SCXML 3.11: exactly one child of an active compound state, all of a parallel state, and no
/// orphan.
std::string illegality(const Chart& chart, const std::vector<StateId>& configuration) {
  std::set<StateId> active(configuration.begin(), configuration.end());
  active.insert(0);
  for (const StateId s : active) {
    const State& self = chart.states.at(static_cast<std::size_t>(s));
    std::size_t regions = 0;
    std::size_t active_children = 0;
    for (const StateId c : self.children) {
      const StateKind kind = chart.states.at(static_cast<std::size_t>(c)).kind;
      const bool history = kind == StateKind::kShallowHistory || kind == StateKind::kDeepHistory;
      if (history && active.count(c) > 0) return "history active: " + self.id;
      if (!history) ++regions;
      active_children += active.count(c);
    }
    if (s != 0 && active.count(self.parent) == 0) return "orphan: " + self.id;
    const std::size_t wanted = self.kind == StateKind::kCompound   ? 1
                               : self.kind == StateKind::kParallel ? regions
                                                                   : 0;
    if (active_children != wanted) return "children of " + self.id;
  }
  return "";
}

/// The first difference between the two; empty if they agree to the end.
std::string disagreement(const Chart& chart, const std::vector<std::string>& events) {
  Interpreter* mine_ptr = nullptr;
  ReferenceInterpreter* reference_ptr = nullptr;
  World my_world(chart, [&](std::string e) { mine_ptr->raise(std::move(e)); });
  World reference_world(chart, [&](const std::string& e) { reference_ptr->enqueue(e); });
  Interpreter mine(chart, my_world);
  ReferenceInterpreter reference(chart, reference_world, Interpreter::kMaxMicrosteps);
  mine_ptr = &mine;
  reference_ptr = &reference;

  const auto difference = [&]() -> std::string {
    const std::string record = my_world.record();
    const std::string expected_record = reference_world.record();
    if (record != expected_record)
      return fmt::format("did {}, expected {}", record, expected_record);
    std::vector<int> expected = reference.configuration();
    expected.erase(expected.begin());  // The root.
    if (mine.configuration() != expected) return "configuration";
    if (mine.running() != reference.running()) return "running";
    if (mine.livelocked() != reference.livelocked()) return "livelocked";
    return illegality(chart, mine.configuration());
  };
  mine.start();
  reference.interpret();
  std::string found = difference();
  for (std::size_t i = 0; i < events.size() && found.empty(); ++i) {
    mine.dispatch(events[i]);
    reference.external_event(events[i]);
    found = difference();
  }
  return found;
}

const std::vector<std::string> kExternalEvents = {"e", "f", "e.x", "g.h", "h"};

RC_GTEST_PROP(Interpreter, DoesWhatTheRecommendationSays, ()) {
  const auto numbers = *rc::gen::container<std::vector<int>>(150, rc::gen::inRange(0, 1000));
  const auto events =
      *rc::gen::container<std::vector<std::string>>(rc::gen::elementOf(kExternalEvents));
  const Chart chart = ChartMaker(numbers).make();
  RC_ASSERT(chart.validate() == "");
  RC_ASSERT(disagreement(chart, events) == "");
}

// The property above finds small counterexamples; this test finds rare ones.
TEST(Interpreter, FollowsTheRecommendationOnManyCharts) {
  Random random(2015);
  const auto below = [&](std::size_t limit) { return random.bits() % limit; };
  for (int round = 0; round < 5'000; ++round) {
    std::vector<int> numbers(50 + below(200));
    for (int& number : numbers) number = static_cast<int>(below(1000));
    std::vector<std::string> events(below(12));
    for (std::string& event : events) event = kExternalEvents[below(kExternalEvents.size())];
    const Chart chart = ChartMaker(numbers).make();
    ASSERT_EQ(chart.validate(), "");
    ASSERT_EQ(disagreement(chart, events), "") << "round " << round;
  }
}

}  // namespace
}  // namespace dive::statechart::testing
