#include "behaviors/failsafes.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace dive::behaviors {
namespace {

std::array<FailsafePolicy, kFailsafeCount> all(Rung rung, double persistence_s = 0.0) {
  std::array<FailsafePolicy, kFailsafeCount> policies;
  policies.fill({rung, persistence_s, 5.0});
  return policies;
}

FailsafePolicy& policy(std::array<FailsafePolicy, kFailsafeCount>& policies, FailsafeKind kind) {
  return policies[static_cast<std::size_t>(kind)];
}

FailsafeConditions only(std::initializer_list<FailsafeKind> kinds) {
  FailsafeConditions conditions{};
  for (const FailsafeKind kind : kinds) conditions[static_cast<std::size_t>(kind)] = true;
  return conditions;
}

TEST(FailsafeLadder, StaysDownWhileNothingIsWrong) {
  FailsafeLadder ladder(all(Rung::kAbortAndSurface));
  for (Utime t = 0; t < from_seconds(10); t += 20'000) {
    EXPECT_FALSE(ladder.update(t, {}).has_value());
  }
  EXPECT_EQ(ladder.rung(), Rung::kNone);
}

TEST(FailsafeLadder, HigherRungWinsAndNamesTheOthers) {
  auto policies = all(Rung::kWarn);
  policy(policies, FailsafeKind::kLeak).rung = Rung::kAbortAndSurface;
  FailsafeLadder ladder(policies);
  const auto change = ladder.update(0, only({FailsafeKind::kOverdepth, FailsafeKind::kLeak}));
  ASSERT_TRUE(change);
  EXPECT_EQ(change->rung, Rung::kAbortAndSurface);
  EXPECT_EQ(change->cause, FailsafeKind::kLeak);
  EXPECT_EQ(change->competing, std::vector<FailsafeKind>{FailsafeKind::kOverdepth});
}

TEST(FailsafeLadder, WaitsForPersistenceWithoutABreak) {
  FailsafeLadder ladder(all(Rung::kAbortAndSurface, 1.0));
  const FailsafeConditions leak = only({FailsafeKind::kLeak});
  EXPECT_FALSE(ladder.update(0, leak));
  EXPECT_FALSE(ladder.update(from_seconds(0.99), leak));
  EXPECT_FALSE(ladder.update(from_seconds(1.0), {})) << "one good sample starts it anew";
  EXPECT_FALSE(ladder.update(from_seconds(1.01), leak));
  EXPECT_FALSE(ladder.update(from_seconds(2.0), leak));
  EXPECT_TRUE(ladder.update(from_seconds(2.01), leak));
}

TEST(FailsafeLadder, TakesAWarningBackOnlyAfterAWhile) {
  FailsafeLadder ladder(all(Rung::kWarn));
  EXPECT_TRUE(ladder.update(0, only({FailsafeKind::kOverdepth})));
  EXPECT_FALSE(ladder.update(from_seconds(1), {}));
  EXPECT_FALSE(ladder.update(from_seconds(5.9), {}));
  const auto change = ladder.update(from_seconds(6.0), {});
  ASSERT_TRUE(change);
  EXPECT_EQ(change->rung, Rung::kNone);
}

TEST(FailsafeLadder, AnAbortIsNotTakenBackButCanBecomeAnEmergency) {
  auto policies = all(Rung::kAbortAndSurface);
  policy(policies, FailsafeKind::kRetraceFailure).rung = Rung::kEmergencySurface;
  FailsafeLadder ladder(policies);
  EXPECT_TRUE(ladder.update(0, only({FailsafeKind::kLeak})));
  EXPECT_FALSE(ladder.update(from_seconds(100), {}));
  EXPECT_EQ(ladder.rung(), Rung::kAbortAndSurface);
  EXPECT_TRUE(ladder.update(from_seconds(101), only({FailsafeKind::kRetraceFailure})));
  EXPECT_FALSE(ladder.update(from_seconds(300), {}));
  EXPECT_EQ(ladder.rung(), Rung::kEmergencySurface);
}

// Whatever happens: from abort_and_surface on the rung never falls, and it never stands below the
// rung of a condition that is true now (no persistence here).
RC_GTEST_PROP(FailsafeLadder, IsMonotoneOnceLatched, ()) {
  std::array<FailsafePolicy, kFailsafeCount> policies;
  for (FailsafePolicy& p : policies) {
    p.rung = *rc::gen::element(Rung::kNone, Rung::kWarn, Rung::kHold, Rung::kAbortAndSurface,
                               Rung::kEmergencySurface);
  }
  FailsafeLadder ladder(policies);
  Utime now = 0;
  for (int tick = 0; tick < 50; ++tick) {
    now += from_seconds(*rc::gen::inRange(0, 4));
    FailsafeConditions conditions{};
    Rung demanded = Rung::kNone;
    for (std::size_t i = 0; i < kFailsafeCount; ++i) {
      conditions[i] = *rc::gen::inRange(0, 4) == 0;
      if (conditions[i]) demanded = std::max(demanded, policies[i].rung);
    }
    const Rung before = ladder.rung();
    const auto change = ladder.update(now, conditions);
    RC_ASSERT(ladder.rung() >= demanded);
    RC_ASSERT(change.has_value() == (ladder.rung() != before));
    if (before >= Rung::kAbortAndSurface) RC_ASSERT(ladder.rung() >= before);
  }
}

}  // namespace
}  // namespace dive::behaviors
