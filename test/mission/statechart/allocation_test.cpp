// The control loop queries the chart fifty times a second; nearly always no transition is enabled.

#include <gtest/gtest.h>

#include "test/common/allocations.h"
#include "test/mission/statechart/draft.h"

namespace dive::statechart::testing {
namespace {

/// An environment without effects, so that only the interpreter can allocate.
class Silent : public Environment {
 public:
  bool evaluate(GuardId) override { return false; }
  void execute(ActionId) override {}
  void entered(StateId) override {}
  void exited(StateId) override {}
  void taken(int, const std::string&) override {}
};

TEST(Allocation, NoneWhenNothingIsEnabledNorForATransition) {
  const Chart chart = Draft("m(p[h~~ r1(a b) r2(c d)] x)")
                          .initial("h", "r1 r2")
                          .on("a", "e", "b")
                          .on("b", "e", "a")
                          .on("p", "g", "x")
                          .when(0)
                          .on("c", "", "d")
                          .when(0)
                          .chart;
  Silent silent;
  Interpreter interpreter(chart, silent);
  interpreter.start();
  const std::string unhandled = "an.event.of.some.length.that.no.state.handles";
  const std::string guarded = "g";
  const std::string handled = "e";
  dive::testing::reset_allocations();
  for (int i = 0; i < 10; ++i) {
    interpreter.settle();
    interpreter.dispatch(unhandled);
    interpreter.dispatch(guarded);
    interpreter.dispatch(handled);
  }
  const std::size_t count = dive::testing::allocations().count;
  EXPECT_EQ(count, 0U);
  EXPECT_TRUE(interpreter.is_active(chart.find("a")));
}

}  // namespace
}  // namespace dive::statechart::testing
