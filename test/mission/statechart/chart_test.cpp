#include "mission/statechart/chart.h"

#include <functional>
#include <ostream>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "common/assert.h"
#include "test/mission/statechart/draft.h"

namespace dive::statechart::testing {
namespace {

constexpr const char* kDrawing = "m(a b(c d(e f)) p[h~ r1(x y) r2(z w)] q(k~~ i j) end!)";

Draft sound() {
  return Draft(kDrawing)
      .initial("h", "r1 r2")
      .initial("k", "i")
      .on("a", "go done.state.b *", "y w")
      .on("a", "", "h")
      .when(0)
      .on("c", "e.*", "", {1})
      .on("q", "e", "k");
}

TEST(Chart, ASoundOneIsValid) { EXPECT_EQ(sound().chart.validate(), ""); }

TEST(Chart, IdsAndAncestryAreFound) {
  const Chart chart = Draft(kDrawing).chart;
  EXPECT_EQ(chart.find("m"), 0);
  EXPECT_EQ(chart.states[static_cast<std::size_t>(chart.find("r2"))].id, "r2");
  EXPECT_EQ(chart.find("nowhere"), -1);
  EXPECT_TRUE(chart.is_descendant(chart.find("f"), chart.find("b")));
  EXPECT_TRUE(chart.is_descendant(chart.find("f"), 0));
  EXPECT_FALSE(chart.is_descendant(chart.find("f"), chart.find("f")));
  EXPECT_FALSE(chart.is_descendant(chart.find("b"), chart.find("f")));
  EXPECT_FALSE(chart.is_descendant(chart.find("x"), chart.find("r2")));
}

TEST(Chart, AnUnknownParentOrSourceIsOurMistake) {
  Chart chart;
  EXPECT_THROW(chart.add_state("a", StateKind::kAtomic, 0), AssertionFailure);
  chart.add_state("m", StateKind::kCompound, -1);
  EXPECT_THROW(chart.add_state("n", StateKind::kCompound, -1), AssertionFailure);
  EXPECT_THROW(chart.add_state("a", StateKind::kAtomic, 1), AssertionFailure);
  EXPECT_THROW(chart.add_transition({}), AssertionFailure);
  EXPECT_THROW(chart.set_initial(1, {}), AssertionFailure);
}

/// One defect in an otherwise valid chart, and the expected sentence.
struct Flaw {
  const char* name;
  std::function<void(Draft&)> make;
  const char* sentence;
};

void PrintTo(const Flaw& flaw, std::ostream* out) { *out << flaw.name; }

State& at(Draft& d, const char* id) {
  return d.chart.states.at(static_cast<std::size_t>(d.chart.find(id)));
}
Transition& initial_of(Draft& d, const char* id) {
  return d.chart.transitions.at(static_cast<std::size_t>(at(d, id).initial));
}

const Flaw kFlaws[] = {
    {"Empty", [](Draft& d) { d.chart = {}; }, "the chart has no states"},
    {"Unreachable", [](Draft& d) { at(d, "m").children.pop_back(); },
     "state 'end' is not below the root"},
    {"ChildThatIsNot", [](Draft& d) { at(d, "end").children.push_back(99); },
     "a child state does not exist"},
    {"Order", [](Draft& d) { std::swap(at(d, "m").children[0], at(d, "m").children[1]); },
     "state 'a' is out of document order"},
    {"Parent", [](Draft& d) { at(d, "c").parent = 0; }, "state 'c' does not name its parent"},
    {"SameId", [](Draft& d) { at(d, "c").id = "a"; }, "two states have the id 'a'"},
    {"NoId", [](Draft& d) { at(d, "c").id = ""; }, "a state has no id"},
    {"RootKind", [](Draft& d) { at(d, "m").kind = StateKind::kParallel; },
     "the root is not a compound state"},
    {"RootActions", [](Draft& d) { at(d, "m").on_exit = {1}; },
     "the root has entry or exit actions"},
    {"NothingBelow", [](Draft& d) { at(d, "a").kind = StateKind::kCompound; },
     "state 'a' has no states below it"},
    {"OnlyHistoryBelow", [](Draft& d) { at(d, "i").kind = at(d, "j").kind = at(d, "k").kind; },
     "state 'q' has no states below it"},
    {"AtomicWithChildren", [](Draft& d) { at(d, "b").kind = StateKind::kAtomic; },
     "state 'b' cannot have children"},
    {"FinalWithChildren", [](Draft& d) { at(d, "b").kind = StateKind::kFinal; },
     "state 'b' cannot have children"},
    {"FinalRegion", [](Draft& d) { d = Draft("m(p[r(a) f!])"); },
     "final state 'f' is the child of a parallel state"},
    {"RootHistory", [](Draft& d) { d = Draft("m(h~ a)").initial("h", "a"); },
     "history 'h' is a child of the root, which is never left"},
    {"HistoryActions", [](Draft& d) { at(d, "h").on_entry = {1}; },
     "history 'h' has entry or exit actions"},
    {"RootTransition", [](Draft& d) { d.on("m", "e", "a"); }, "state 'm' cannot have transitions"},
    {"FinalTransition", [](Draft& d) { d.on("end", "e", "a"); },
     "state 'end' cannot have transitions"},
    {"HistoryTransition", [](Draft& d) { d.on("h", "e", "a"); },
     "state 'h' cannot have transitions"},
    {"TransitionThatIsNot", [](Draft& d) { at(d, "c").transitions.push_back(99); },
     "a transition of 'c' does not exist"},
    {"OtherSource", [](Draft& d) { d.chart.transitions.back().source = 1; },
     "a transition of 'q' has another source"},
    {"Nothing", [](Draft& d) { d.on("c", "", ""); },
     "a transition of 'c' has neither event, guard nor target"},
    {"EmptyDescriptor", [](Draft& d) { d.chart.transitions.back().events.emplace_back(); },
     "a transition of 'q' has the event descriptor ''"},
    {"BlankDescriptor", [](Draft& d) { d.chart.transitions.back().events.emplace_back("a b"); },
     "a transition of 'q' has the event descriptor 'a b'"},
    {"TargetThatIsNot", [](Draft& d) { d.on("c", "e", "nowhere"); },
     "a target of 'c' does not exist"},
    {"TargetRoot", [](Draft& d) { d.on("c", "e", "m"); }, "a transition of 'c' targets the root"},
    {"Twice", [](Draft& d) { d.on("c", "e", "x x"); },
     "a transition of 'c' targets 'x' and 'x', which exclude each other"},
    {"OneRegion", [](Draft& d) { d.on("c", "e", "x y"); },
     "a transition of 'c' targets 'x' and 'y', which exclude each other"},
    {"InsideEachOther", [](Draft& d) { d.on("c", "e", "z r2"); },
     "a transition of 'c' targets 'z' and 'r2', which exclude each other"},
    {"HistoryAndWhatItRestores", [](Draft& d) { d.on("c", "e", "h z"); },
     "a transition of 'c' targets 'h' and 'z', which exclude each other"},
    {"Unlisted", [](Draft& d) { at(d, "q").transitions.pop_back(); },
     "transition 11 is listed 0 times"},
    {"ListedTwice", [](Draft& d) { at(d, "q").transitions.push_back(at(d, "q").transitions[0]); },
     "transition 11 is listed 2 times"},
    {"InitialOfAtomic", [](Draft& d) { d.chart.set_initial(d.chart.find("a"), {2}); },
     "state 'a' cannot have an initial state"},
    {"NoInitial", [](Draft& d) { initial_of(d, "b").targets.clear(); },
     "state 'b' has no initial state"},
    {"NoDefault", [](Draft& d) { initial_of(d, "h").targets.clear(); },
     "state 'h' has no initial state"},
    {"InitialEvent", [](Draft& d) { initial_of(d, "b").events = {"e"}; },
     "the initial transition of 'b' is not one"},
    {"InitialGuard", [](Draft& d) { initial_of(d, "b").guard = 0; },
     "the initial transition of 'b' is not one"},
    {"InitialExternal", [](Draft& d) { initial_of(d, "b").internal = false; },
     "the initial transition of 'b' is not one"},
    {"InitialTargetThatIsNot", [](Draft& d) { d.initial("b", "nowhere"); },
     "a target of 'b' does not exist"},
    {"InitialConflict", [](Draft& d) { d.initial("b", "c e"); },
     "a transition of 'b' targets 'c' and 'e', which exclude each other"},
    {"InitialElsewhere", [](Draft& d) { d.initial("b", "a"); },
     "'a' cannot be an initial state of 'b'"},
    {"InitialItself", [](Draft& d) { d.initial("b", "b"); },
     "'b' cannot be an initial state of 'b'"},
    {"ShallowDefaultTooDeep", [](Draft& d) { d.initial("h", "x"); },
     "'x' cannot be an initial state of 'h'"},
    {"DefaultElsewhere", [](Draft& d) { d.initial("k", "x"); },
     "'x' cannot be an initial state of 'k'"},
    {"DefaultIsHistory", [](Draft& d) { d.initial("k", "k"); },
     "'k' cannot be an initial state of 'k'"},
};

class ChartFlaw : public ::testing::TestWithParam<Flaw> {};

TEST_P(ChartFlaw, IsNamed) {
  Draft draft = sound();
  GetParam().make(draft);
  EXPECT_EQ(draft.chart.validate(), GetParam().sentence);
}

INSTANTIATE_TEST_SUITE_P(Each, ChartFlaw, ::testing::ValuesIn(kFlaws),
                         [](const auto& case_info) { return case_info.param.name; });

}  // namespace
}  // namespace dive::statechart::testing
