// The rules of SCXML, one small chart each. The numbers are those of the W3C test assertions on
// which a test is based.

#include "mission/statechart/interpreter.h"

#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "common/assert.h"
#include "test/mission/statechart/draft.h"

namespace dive::statechart::testing {
namespace {

// ---------------------------------------------------------------------------- initial states

TEST(Initial, ByDefaultTheFirstStateInDocumentOrder_355) {
  Machine m(Draft("m(a b)"));
  EXPECT_EQ(m.start(), "+a");
  EXPECT_TRUE(m.interpreter.running());
}

TEST(Initial, EntersDeepTargetsAndTheirAncestorsInDocumentOrder_364) {
  Machine m(Draft("m(a(b(c d)))").initial("m", "d"));
  EXPECT_EQ(m.start(), "+a +b +d");
}

TEST(Initial, SeveralTargetsInRegionsTheOthersByDefault_576) {
  Machine m(Draft("m(x p[r1(a b) r2(c d) r3(e f)])").initial("m", "b f"));
  EXPECT_EQ(m.start(), "+p +r1 +b +r2 +c +r3 +f");
}

TEST(Initial, ActionsOfTheInitialTransitionRunAfterEntryAndBeforeTheChild_412) {
  Machine m(Draft("m(a(b))").actions("a", {1}).actions("b", {3}).initial("a", "b", {2}));
  EXPECT_EQ(m.start(), "#1 #2 +a #3 +b");
}

// ---------------------------------------------------------------------------- done events

TEST(Done, AFinalChildCompletesItsParentAfterItsEntryActions_372_416) {
  Machine m(Draft("m(a(b c!) d)")
                .on("a", "done.state.a", "d", {9})
                .on("b", "go", "c")
                .actions("c", {1}, {2}));
  m.start();
  EXPECT_EQ(m.dispatch("go"), "-b #1 +c -c #2 -a #9 +d");
}

TEST(Done, AParallelStateCompletesWithItsLastRegion_417_570) {
  Machine m(Draft("m(p[r1(a b!) r2(c d!)] e)")
                .on("a", "one", "b")
                .on("c", "two", "d")
                .on("p", "done.state.p", "e")
                .on("r1", "done.state.r1", "", {1})
                .on("r2", "done.state.r2", "", {2}));
  m.start();
  EXPECT_EQ(m.dispatch("two"), "-c +d #2");
  EXPECT_EQ(m.dispatch("one"), "-a +b #1 -d -r2 -b -r1 -p +e");
}

TEST(Done, AParallelRegionOfAParallelStateCompletesIt) {
  Machine m(Draft("m(p[q[r1(a b!) r2(c d!)] r3(e f!)] g)")
                .on("a", "go", "b")
                .on("c", "go", "d")
                .on("e", "go", "f")
                .on("e", "first", "f")
                .on("p", "done.state.p", "g"));
  m.start();
  m.dispatch("first");
  m.dispatch("go");
  EXPECT_EQ(m.active(), "g");
}

TEST(Done, AFinalStateOfTheRootEndsTheChartAndStaysActive) {
  Machine m(Draft("m(a f!)").on("a", "go", "f").on("a", "*", "", {1}));
  m.start();
  EXPECT_EQ(m.dispatch("go"), "-a +f");
  EXPECT_FALSE(m.interpreter.running());
  EXPECT_FALSE(m.interpreter.livelocked());
  EXPECT_EQ(m.active(), "f");
  EXPECT_EQ(m.dispatch("go"), "");
  m.interpreter.settle();
  EXPECT_EQ(m.active(), "f");
}

TEST(Done, AnAtomicStateCompletesWhenItsEnvironmentReportsIt) {
  Machine m(Draft("m(a b)").on("a", "done.state.a", "b"));
  m.recorder.on_entered["a"] = [&] { m.interpreter.raise("done.state.a"); };
  EXPECT_EQ(m.start(), "+a -a +b");
}

// ---------------------------------------------------------------------------- history

Draft history_draft(const std::string& mark) {
  return Draft("m(out p(h" + mark + " a b(c(x y) d)))")
      .initial("h", "a", {7})
      .on("out", "back", "h")
      .on("p", "leave", "out")
      .on("a", "go", "y");
}

TEST(History, TakesItsDefaultWhenNothingIsRecorded_387_579) {
  for (const char* mark : {"~", "~~"}) {
    Machine m(history_draft(mark));
    m.start();
    // Content of the default: after the parent's entry, before the child's.
    EXPECT_EQ(m.dispatch("back"), "-out #7 +p +a") << mark;
  }
}

TEST(History, ShallowRestoresTheChildAndEntersItByDefault_388) {
  Machine m(history_draft("~"));
  m.start();
  m.dispatch("back");
  m.dispatch("go");
  EXPECT_EQ(m.dispatch("leave"), "-y -c -b -p +out");
  EXPECT_EQ(m.dispatch("back"), "-out +p +b +c +x");
}

TEST(History, DeepRestoresTheAtomicState_388) {
  Machine m(history_draft("~~"));
  m.start();
  m.dispatch("back");
  m.dispatch("go");
  m.dispatch("leave");
  EXPECT_EQ(m.dispatch("back"), "-out +p +b +c +y");
}

TEST(History, DeepRestoresEveryRegion) {
  Machine m(Draft("m(p[h~~ r1(a b) r2(c d)] out)")
                .initial("h", "a c")
                .on("a", "go", "b")
                .on("c", "go", "d")
                .on("p", "leave", "out")
                .on("out", "back", "h"));
  m.start();
  m.dispatch("go");
  m.dispatch("leave");
  EXPECT_EQ(m.dispatch("back"), "-out +p +r1 +b +r2 +d");
}

TEST(History, IsNeverActive_580) {
  Machine m(history_draft("~"));
  m.start();
  for (const char* event : {"back", "go", "leave", "back"}) {
    m.dispatch(event);
    EXPECT_FALSE(m.interpreter.is_active(m.chart.find("h"))) << event;
  }
}

TEST(History, IsForgottenOnRestart) {
  Machine m(Draft("m(out p(h~ a b) f!)")
                .initial("h", "a")
                .on("out", "back", "h")
                .on("a", "go", "b")
                .on("p", "leave", "out")
                .on("out", "end", "f"));
  m.start();
  for (const char* event : {"back", "go", "leave", "end"}) m.dispatch(event);
  m.start();
  EXPECT_EQ(m.dispatch("back"), "-out +p +a");
}

TEST(History, RecordedOnExitDoesNotMoveTheDomain) {
  // By h's default the transition exits p; the history it then records lies within its source, r.
  Machine m(Draft("m(p[h~~ r(a b)])").initial("h", "r").on("r", "e", "h").internal());
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-a -r -p +p +r +a");
}

// ---------------------------------------------------------------------------- selection, order

TEST(Selection, InnerTransitionsFirstThenDocumentOrder_403) {
  Machine m(Draft("m(a(b) x y z)").on("a", "e", "x").on("b", "e", "y").on("b", "e", "z"));
  m.start();
  m.dispatch("e");
  EXPECT_EQ(m.active(), "y");
}

TEST(Selection, AFalseGuardPassesToTheNextThenToTheParent_403) {
  Machine m(Draft("m(a(b) x y)").on("b", "e", "y").when(0).on("a", "e", "x"));
  m.recorder.guards[0] = [] { return false; };
  m.start();
  m.dispatch("e");
  EXPECT_EQ(m.active(), "x");
}

TEST(Selection, EveryRegionTakesItsOwn_403) {
  Machine m(Draft("m(p[r1(a b) r2(c d)])").on("a", "e", "b", {1}).on("c", "e", "d", {2}));
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-c -a #1 #2 +b +d");
}

TEST(Selection, OfConflictingTransitionsTheFirstRegionWins_403) {
  Machine m(Draft("m(p[r1(a) r2(c)] x y)").on("a", "e", "x").on("c", "e", "y"));
  m.start();
  m.dispatch("e");
  EXPECT_EQ(m.active(), "x");
}

TEST(Selection, ATransitionDeeperDownPreemptsItsAncestorsSelectedEarlier_403) {
  // r1 has no transition of its own, so p's is selected for it; that of c, selected later, is below
  // p.
  Machine m(Draft("m(p[r1(a) r2(c d)] x)").on("p", "e", "x").on("c", "e", "d"));
  m.start();
  m.dispatch("e");
  EXPECT_EQ(m.active(), "p r1 a r2 d");
}

TEST(Selection, TargetlessTransitionsConflictWithNothing) {
  Machine m(Draft("m(p[r1(a) r2(c)] x)").on("a", "e", "", {1}).on("c", "e", "x", {2}));
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-c -r2 -a -r1 -p #1 #2 +x");
}

TEST(Order, ExitsChildrenFirstRunsContentThenEnters_404_405_406) {
  Machine m(Draft("m(p[r1(a) r2(c)] q[r3(x) r4(y)])")
                .actions("p", {}, {1})
                .actions("r1", {}, {2})
                .actions("r2", {}, {3})
                .actions("q", {4})
                .actions("r3", {5})
                .actions("r4", {6})
                .on("p", "e", "q", {9}));
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-c -r2 #3 -a -r1 #2 -p #1 #9 #4 +q #5 +r3 +x #6 +r4 +y");
}

TEST(Order, AStateIsActiveFromItsEntryToTheEndOfItsExit_409_411) {
  Machine m(Draft("m(a(b) c)").actions("a", {1}, {2}).actions("b", {}, {3}).on("a", "e", "c"));
  const auto in = [&](const char* id) { return m.interpreter.is_active(m.chart.find(id)); };
  std::string seen;
  const auto look = [&] { seen += fmt::format("{}{} ", in("a") ? "a" : "-", in("b") ? "b" : "-"); };
  m.recorder.on_action = {{1, look}, {2, look}, {3, look}};
  m.start();
  m.dispatch("e");
  EXPECT_EQ(seen, "a- ab a- ");
}

TEST(Order, EventlessTransitionsComeBeforeRaisedEvents_419) {
  Machine m(Draft("m(a x y)").actions("a", {1}).on("a", "raised", "x").on("a", "", "y"));
  m.recorder.on_action[1] = [&] { m.interpreter.raise("raised"); };
  m.start();
  EXPECT_EQ(m.active(), "y");
}

TEST(Order, RaisedEventsAreHandledInOrderBeforeTheNextExternalOne_421_423) {
  Machine m(Draft("m(a b c)")
                .on("a", "go", "", {1})
                .on("a", "first", "b")
                .on("b", "second", "c")
                .on("a", "second", "", {8}));
  m.recorder.on_action[1] = [&] {
    m.interpreter.raise("first");
    m.interpreter.raise("unhandled");
    m.interpreter.raise("second");
  };
  m.start();
  EXPECT_EQ(m.dispatch("go"), "#1 -a +b -b +c");
}

TEST(Order, RaisedBetweenMacrostepsComesBeforeTheExternalEvent) {
  Machine m(Draft("m(a b c)").on("a", "raised", "b").on("b", "external", "c"));
  m.start();
  m.interpreter.raise("raised");
  EXPECT_EQ(m.active(), "a");
  m.dispatch("external");
  EXPECT_EQ(m.active(), "c");
}

TEST(Order, RaisedBeforeTheEndIsForgottenOnRestart) {
  Machine m(Draft("m(a b f!)").on("a", "go", "f", {1}).on("a", "raised", "b"));
  m.recorder.on_action[1] = [&] { m.interpreter.raise("raised"); };
  m.start();
  m.dispatch("go");
  EXPECT_EQ(m.active(), "f");
  EXPECT_EQ(m.start(), "+a");
}

TEST(Order, TakenIsReportedBeforeAnyExitWithItsEvent) {
  Machine m(Draft("m(a b c)").on("a", "x.*", "b").on("b", "", "c"));
  m.recorder.note_taken = true;
  EXPECT_EQ(m.start(), "+a");
  const int first = m.chart.states[1].transitions[0];
  EXPECT_EQ(m.dispatch("x.y"), fmt::format("t{}:x.y -a +b t{}: -b +c", first, first + 1));
}

TEST(Order, SettleTakesWhatAGuardHasOpenedSince) {
  Machine m(Draft("m(a b)").on("a", "", "b").when(0));
  bool open = false;
  m.recorder.guards[0] = [&] { return open; };
  m.start();
  EXPECT_EQ(m.active(), "a");
  open = true;
  EXPECT_EQ(m.active(), "a");
  m.interpreter.settle();
  EXPECT_EQ(m.active(), "b");
}

// ---------------------------------------------------------------------------- exit sets

TEST(ExitSet, AnExternalTransitionToADescendantLeavesItsSource_503_504) {
  Machine m(Draft("m(a(b c))").on("a", "e", "c"));
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-b -a +a +c");
}

TEST(ExitSet, AnInternalOneDoesNot_505) {
  Machine m(Draft("m(a(b c))").on("a", "e", "c").internal());
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-b +c");
}

TEST(ExitSet, InternalToElsewhereIsExternal_506) {
  Machine m(Draft("m(a(b) c)").on("a", "e", "c").internal().on("c", "e", "c").internal());
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-b -a +c");
  EXPECT_EQ(m.dispatch("e"), "-c +c");
}

TEST(ExitSet, InternalFromAParallelStateIsExternal_533) {
  Machine m(Draft("m(p[r1(a b) r2(c d)])").on("p", "e", "b").internal());
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-c -r2 -a -r1 -p +p +r1 +b +r2 +c");
}

TEST(ExitSet, WithinARegionTheOtherRegionsStay) {
  Machine m(Draft("m(p[r1(a b) r2(c)])").on("a", "e", "b"));
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-a +b");
}

TEST(ExitSet, FromOneRegionToAnotherLeavesTheParallelState) {
  Machine m(Draft("m(p[r1(a) r2(c d)])").on("a", "e", "d"));
  m.start();
  EXPECT_EQ(m.dispatch("e"), "-c -r2 -a -r1 -p +p +r1 +a +r2 +d");
}

// ---------------------------------------------------------------------------- bounds, misuse

TEST(Livelock, IsStoppedAndSaidAndARestartIsClean) {
  Machine m(Draft("m(a b c)").on("a", "go", "b").on("b", "", "c").on("c", "", "b"));
  m.start();
  const std::string record = m.dispatch("go");
  EXPECT_TRUE(m.interpreter.livelocked());
  EXPECT_FALSE(m.interpreter.running());
  // "-a +b" and then at most kMaxMicrosteps times "-x +y".
  EXPECT_EQ(record.size(), 5 + 6 * static_cast<std::size_t>(Interpreter::kMaxMicrosteps));
  EXPECT_EQ(m.dispatch("go"), "");
  EXPECT_EQ(m.start(), "+a");
  EXPECT_FALSE(m.interpreter.livelocked());
}

TEST(Livelock, RaisingForEverIsOneToo) {
  Machine m(Draft("m(a)").on("a", "e", "", {1}));
  m.recorder.on_action[1] = [&] { m.interpreter.raise("e"); };
  m.start();
  m.dispatch("e");
  EXPECT_TRUE(m.interpreter.livelocked());
}

TEST(Livelock, AsManyMicrostepsAsAllowedAreNone) {
  Machine m(Draft("m(a)").on("a", "", "", {1}).when(0));
  int left = 0;
  m.recorder.guards[0] = [&] { return left > 0; };
  m.recorder.on_action[1] = [&] { --left; };
  m.start();
  left = Interpreter::kMaxMicrosteps;
  m.interpreter.settle();
  EXPECT_FALSE(m.interpreter.livelocked());
  left = Interpreter::kMaxMicrosteps + 1;
  m.interpreter.settle();
  EXPECT_TRUE(m.interpreter.livelocked());
}

TEST(Misuse, IsOurMistakeAndDemanded) {
  Machine m(Draft("m(a)").on("a", "e", "", {1}));
  m.start();
  EXPECT_THROW(m.interpreter.start(), AssertionFailure);
  EXPECT_THROW(m.interpreter.dispatch(""), AssertionFailure);
  EXPECT_THROW(m.interpreter.raise(""), AssertionFailure);
  m.recorder.on_action[1] = [&] { m.interpreter.dispatch("e"); };
  EXPECT_THROW(m.interpreter.dispatch("e"), AssertionFailure);

  Chart broken = Draft("m(a)").chart;
  broken.states[0].initial = -1;
  EXPECT_THROW(Interpreter(broken, m.recorder), AssertionFailure);
}

// ---------------------------------------------------------------------------- descriptors

TEST(Matches, TokenByToken) {
  const auto matches = [](const char* d, const char* e) { return Interpreter::matches(d, e); };
  EXPECT_TRUE(matches("*", "anything.at.all"));
  EXPECT_TRUE(matches("error", "error"));
  EXPECT_TRUE(matches("error", "error.send"));
  EXPECT_TRUE(matches("error", "error.send.failed"));
  EXPECT_FALSE(matches("error", "errors.my.custom"));
  EXPECT_FALSE(matches("error", "errorhandler.mistake"));
  EXPECT_FALSE(matches("error.send", "error"));
  EXPECT_FALSE(matches("error.send", "error.sender"));
  EXPECT_FALSE(matches("Error", "error"));
  for (const char* same : {"error.*", "error."}) {
    EXPECT_TRUE(matches(same, "error"));
    EXPECT_TRUE(matches(same, "error.send"));
    EXPECT_FALSE(matches(same, "errors"));
  }
}

}  // namespace
}  // namespace dive::statechart::testing
