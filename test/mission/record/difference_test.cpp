#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "mission/record/log.h"
#include "test/mission/record/sample.h"

namespace dive::mission::testing {
namespace {

/// Outputs with every field set.
StepOutputs full_outputs() {
  SampleMaker maker(7);
  LoggedTick tick;
  do {
    tick = maker.tick(0);
  } while (!tick.outputs.plan_query || tick.outputs.plan_query->request.previous.size() != 3 ||
           tick.outputs.plan_query->request.trail.size() != 2 ||
           tick.outputs.transitions.size() < 2 || tick.outputs.failsafes.size() < 2 ||
           tick.outputs.actions.size() < 2);
  return tick.outputs;
}

void change(double& value) {
  const auto flipped = std::bit_cast<std::uint64_t>(value) ^ 1U;  // The last bit only.
  value = std::bit_cast<double>(flipped);
}
void change(std::string& value) { value += "x"; }
void change(bool& value) { value = !value; }
template <typename T>
void change(T& value) {
  value = static_cast<T>(static_cast<std::int64_t>(value) ^ 1);
}

TEST(FirstDifference, NoneBetweenTheSame) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const StepOutputs outputs = sample_ticks(seed, 1)[0].outputs;
    EXPECT_EQ(first_difference(outputs, StepOutputs(outputs)), "");
  }
}

TEST(FirstDifference, IsFoundAndNamedInEveryField) {
  const StepOutputs logged = full_outputs();
  int fields = 0;
  each_output(const_cast<StepOutputs&>(logged), [&](const std::string&, auto&) { ++fields; });
  ASSERT_EQ(fields, 160);
  for (int changed = 0; changed < fields; ++changed) {
    StepOutputs replayed = logged;
    std::string expected;
    int field = 0;
    each_output(replayed, [&](const std::string& name, auto& value) {
      if (field++ != changed) return;
      expected = name;
      change(value);
    });
    const std::string difference = first_difference(logged, replayed);
    EXPECT_TRUE(difference.starts_with(expected + ": logged ")) << expected << " / " << difference;
    EXPECT_NE(difference.find(", replayed "), std::string::npos);
  }
}

TEST(FirstDifference, NamesBothValues) {
  StepOutputs logged;
  StepOutputs replayed;
  replayed.command.v = 0.1;
  EXPECT_EQ(first_difference(logged, replayed), "DIVE_OUT_COMMAND.v: logged 0, replayed 0.1");
  replayed = logged;
  replayed.status.state = "hold";
  EXPECT_EQ(first_difference(logged, replayed),
            "DIVE_OUT_STATUS.state: logged '', replayed 'hold'");
  replayed = logged;
  replayed.estimate.valid = true;
  EXPECT_EQ(first_difference(logged, replayed),
            "DIVE_OUT_ESTIMATE.valid: logged false, replayed true");
}

TEST(FirstDifference, ComparesBitsNotValues) {
  StepOutputs logged;
  StepOutputs replayed;
  logged.rates.yaw = 0.0;
  replayed.rates.yaw = -0.0;
  EXPECT_EQ(first_difference(logged, replayed), "DIVE_OUT_RATES.yaw: logged 0, replayed -0");
  logged.rates.yaw = replayed.rates.yaw = std::nan("");
  EXPECT_EQ(first_difference(logged, replayed), "");
  replayed.rates.yaw = std::nan("5");
  EXPECT_EQ(first_difference(logged, replayed),
            "DIVE_OUT_RATES.yaw: logged nan (0x7ff8000000000000), "
            "replayed nan (0x7ff8000000000005)");
}

TEST(FirstDifference, IsTheFirstOfSeveral) {
  StepOutputs replayed;
  replayed.status.segment = 3;
  replayed.command.d = 2.0;
  EXPECT_EQ(first_difference({}, replayed), "DIVE_OUT_COMMAND.d: logged 0, replayed 2");
}

TEST(FirstDifference, OneMoreOrOneLess) {
  const StepOutputs none;
  StepOutputs some;
  some.plan_query = PlanQuery{};
  EXPECT_EQ(first_difference(none, some),
            "DIVE_OUT_PLAN_QUERY.present: logged false, replayed true");
  some = none;
  some.transitions.resize(2);
  EXPECT_EQ(first_difference(some, none), "DIVE_OUT_TRANSITION.count: logged 2, replayed 0");
  some = none;
  some.failsafes.resize(1);
  EXPECT_EQ(first_difference(none, some), "DIVE_OUT_FAILSAFE.count: logged 0, replayed 1");
  some = none;
  some.plan_query = PlanQuery{};
  StepOutputs more = some;
  more.plan_query->request.previous.resize(1);
  EXPECT_EQ(first_difference(some, more),
            "DIVE_OUT_PLAN_QUERY.previous.count: logged 0, replayed 1");
  StepOutputs swum = some;
  swum.plan_query->request.trail.resize(2);
  EXPECT_EQ(first_difference(swum, some), "DIVE_OUT_PLAN_QUERY.trail.count: logged 2, replayed 0");
}

}  // namespace
}  // namespace dive::mission::testing
