#include "behaviors/failsafes.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace dive::behaviors {
namespace {

FailsafePolicies all(Rung rung, double persistence_s = 0.0) {
  FailsafePolicies policies;
  policies.fill({.rung = rung, .persistence_s = persistence_s});
  return policies;
}

FailsafePolicy& policy(FailsafePolicies& policies, FailsafeKind kind) {
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
    EXPECT_FALSE(ladder.update(t, {}, true).has_value());
  }
  EXPECT_EQ(ladder.rung(), Rung::kNone);
}

TEST(FailsafeLadder, HigherRungWinsAndNamesTheOthers) {
  auto policies = all(Rung::kWarn);
  policy(policies, FailsafeKind::kLeak).rung = Rung::kAbortAndSurface;
  FailsafeLadder ladder(policies);
  const auto change = ladder.update(0, only({FailsafeKind::kOverdepth, FailsafeKind::kLeak}), true);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->rung, Rung::kAbortAndSurface);
  EXPECT_EQ(change->cause, FailsafeKind::kLeak);
  EXPECT_EQ(change->competing, std::vector<FailsafeKind>{FailsafeKind::kOverdepth});
}

TEST(FailsafeLadder, WaitsForPersistenceWithoutABreak) {
  FailsafeLadder ladder(all(Rung::kAbortAndSurface, 1.0));
  const FailsafeConditions leak = only({FailsafeKind::kLeak});
  EXPECT_FALSE(ladder.update(0, leak, true));
  EXPECT_FALSE(ladder.update(from_seconds(0.99), leak, true));
  EXPECT_FALSE(ladder.update(from_seconds(1.0), {}, true)) << "one good sample starts it again";
  EXPECT_FALSE(ladder.update(from_seconds(1.01), leak, true));
  EXPECT_FALSE(ladder.update(from_seconds(2.0), leak, true));
  EXPECT_TRUE(ladder.update(from_seconds(2.01), leak, true));
}

TEST(FailsafeLadder, TakesAWarningBackOnlyAfterAWhile) {
  FailsafeLadder ladder(all(Rung::kWarn));
  EXPECT_TRUE(ladder.update(0, only({FailsafeKind::kOverdepth}), true));
  EXPECT_FALSE(ladder.update(from_seconds(1), {}, true));
  EXPECT_FALSE(ladder.update(from_seconds(5.9), {}, true));
  const auto change = ladder.update(from_seconds(6.0), {}, true);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->rung, Rung::kNone);
}

TEST(FailsafeLadder, AnAbortIsNotTakenBackButCanBecomeAnEmergency) {
  auto policies = all(Rung::kAbortAndSurface);
  policy(policies, FailsafeKind::kRetraceFailure).rung = Rung::kEmergencySurface;
  FailsafeLadder ladder(policies);
  EXPECT_TRUE(ladder.update(0, only({FailsafeKind::kLeak}), true));
  EXPECT_FALSE(ladder.update(from_seconds(100), {}, true));
  EXPECT_EQ(ladder.rung(), Rung::kAbortAndSurface);
  EXPECT_TRUE(ladder.update(from_seconds(101), only({FailsafeKind::kRetraceFailure}), true));
  EXPECT_FALSE(ladder.update(from_seconds(300), {}, true));
  EXPECT_EQ(ladder.rung(), Rung::kEmergencySurface);
}

// Whatever happens: from abort_and_surface on the rung never falls, and it never stands below the
// rung of a condition that is true now (no persistence here).
RC_GTEST_PROP(FailsafeLadder, IsMonotoneOnceLatched, ()) {
  FailsafePolicies policies;
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
    const FailsafeKind cause_before = ladder.cause();
    const auto change = ladder.update(now, conditions, true);
    RC_ASSERT(ladder.rung() >= demanded);
    RC_ASSERT(change.has_value() == (ladder.rung() != before || ladder.cause() != cause_before));
    if (before >= Rung::kRetrace) RC_ASSERT(ladder.rung() >= before);
  }
}

TEST(FailsafeLadder, HoldBecomesAnAbortOnlyWhereItCanAscend) {
  FailsafeLadder ladder(all(Rung::kHold));
  const FailsafeConditions lost = only({FailsafeKind::kImuLost});
  EXPECT_TRUE(ladder.update(0, lost, false));
  EXPECT_FALSE(ladder.update(from_seconds(600), lost, false)) << "under an overhead it waits";
  const auto change = ladder.update(from_seconds(601), lost, true);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->rung, Rung::kAbortAndSurface);
  EXPECT_TRUE(change->escalated);
}

// A condition that has ended and only waits for clear_s does not escalate.
TEST(FailsafeLadder, AHoldWhoseCauseIsGoneIsTakenBack) {
  FailsafePolicies policies{};
  for (FailsafePolicy& policy : policies) policy.rung = Rung::kNone;
  policies[static_cast<std::size_t>(FailsafeKind::kImuLost)] = {
      .rung = Rung::kHold, .persistence_s = 0.0, .clear_s = 2.0, .escalate_s = 2.0};
  FailsafeLadder ladder(policies);
  EXPECT_TRUE(ladder.update(0, only({FailsafeKind::kImuLost}), true));
  EXPECT_FALSE(ladder.update(from_seconds(1.5), {}, true));
  EXPECT_FALSE(ladder.update(from_seconds(3.0), {}, true)) << "overdue, were it still so";
  const auto change = ladder.update(from_seconds(3.5), {}, true);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->rung, Rung::kNone);
}

TEST(FailsafeLadder, ReplanDoesNotGoOnForEver) {
  FailsafeLadder ladder(all(Rung::kReplan));
  const FailsafeConditions stuck = only({FailsafeKind::kStuck});
  EXPECT_TRUE(ladder.update(0, stuck, false));
  EXPECT_FALSE(ladder.update(from_seconds(59), stuck, false));
  EXPECT_EQ(ladder.update(from_seconds(60), stuck, false)->rung, Rung::kAbortAndSurface);
}

TEST(FailsafeLadder, OfTwoThatAskForTheSameTheFirstKeepsIt) {
  FailsafeLadder ladder(all(Rung::kHold));
  EXPECT_TRUE(ladder.update(0, only({FailsafeKind::kHealthLost}), true));
  EXPECT_FALSE(ladder.update(1, only({FailsafeKind::kHealthLost, FailsafeKind::kImuLost}), true));
  EXPECT_EQ(ladder.cause(), FailsafeKind::kHealthLost);
}

TEST(Failsafes, HaveNamesThatFindThem) {
  for (std::size_t i = 0; i < kFailsafeCount; ++i) {
    const auto kind = static_cast<FailsafeKind>(i);
    EXPECT_EQ(find_failsafe(to_string(kind)), kind);
  }
  EXPECT_FALSE(find_failsafe("leaks"));
  EXPECT_EQ(find_rung("hold"), Rung::kHold);
  EXPECT_FALSE(find_rung("none"));
}

}  // namespace
}  // namespace dive::behaviors
