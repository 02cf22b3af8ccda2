// The simulated dives of `dive check`: their number, their statistics and the findings.

#include "mission/check/dive_series.h"

#include <array>
#include <cmath>
#include <set>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/check/check.h"
#include "mission/document/mission.h"
#include "mission/simulation/simulated_conditions.h"
#include "vehicle/model.h"

namespace dive::mission {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;

// ------------------------------------------------------------------------ the bound

TEST(UpperBound, HasItsClosedFormWithNoneAndWithAllButOne) {
  for (const int trials : {1, 2, 10, 59, 1000, 100'000}) {
    EXPECT_NEAR(upper_bound_95(0, trials), 1.0 - std::pow(0.05, 1.0 / trials), 1e-12) << trials;
    EXPECT_NEAR(upper_bound_95(trials - 1, trials), std::pow(0.95, 1.0 / trials), 1e-9) << trials;
    EXPECT_EQ(upper_bound_95(trials, trials), 1.0);
  }
}

// By the relation of binomial and F distribution, k of n have the bound
// (k + 1) F / (n - k + (k + 1) F), F being the 95 % point with 2 (k + 1) and 2 (n - k) degrees of
// freedom. The points are those of the usual tables.
TEST(UpperBound, AgreesWithTablesOfTheFDistribution) {
  struct Entry {
    int events, trials;
    double f;
  };
  for (const auto& [events, trials, f] :
       {Entry{0, 10, 3.49}, Entry{1, 11, 2.87}, Entry{1, 31, 2.53}, Entry{4, 14, 2.35},
        Entry{4, 34, 1.99}, Entry{9, 19, 2.12}}) {
    const double k = events + 1.0;
    const double expected = k * f / (trials - events + k * f);
    EXPECT_NEAR(upper_bound_95(events, trials), expected, 0.001) << events << " of " << trials;
  }
}

TEST(UpperBound, HoldsForManyTrialsWhoseTermsAreBelowTheLeastDouble) {
  // The normal approximation with its continuity correction.
  const double n = 100'000.0;
  EXPECT_NEAR(upper_bound_95(50'000, 100'000), 0.5 + 1.6449 * std::sqrt(0.25 / n) + 0.5 / n, 1e-5);
}

// ------------------------------------------------------------------------ the summary

DiveEnd ended(std::uint64_t seed, const std::string& outcome, double clearance_m,
              std::size_t collisions = 0) {
  DiveEnd end;
  end.seed = seed;
  end.outcome = outcome;
  end.final_state = "state_" + outcome;
  end.cause = "cause of " + std::to_string(seed);
  end.collisions = collisions;
  end.surfaced = outcome == "success";
  end.nearest.clearance_m = clearance_m;
  end.nearest.obstacle = "rock";
  end.command = "dive run m.xml --seed " + std::to_string(seed);
  return end;
}

std::vector<DiveEnd> successes(int count) {
  std::vector<DiveEnd> ends;
  for (int i = 0; i < count; ++i) ends.push_back(ended(7 + i, "success", 0.5 + 0.01 * i));
  return ends;
}

TEST(DiveSummary, CountsAndHasTheWorstFirst) {
  std::vector<DiveEnd> ends = successes(6);
  ends[2] = ended(9, "failure", 0.0, 1);
  ends[3] = ended(10, "aborted", 0.9);
  ends[4] = ended(11, "failure", 0.0, 3);
  ends[5].surfaced = false;
  const DiveSeries series = summarise(ends);
  EXPECT_EQ(series.first_seed, 7U);
  EXPECT_EQ(series.dives, 6);
  EXPECT_EQ(series.successes, 3);
  EXPECT_EQ(series.surfaced, 2);
  EXPECT_EQ(series.collisions, 2);
  EXPECT_EQ(series.aborted(), 1);
  EXPECT_EQ(series.collision_bound_95, upper_bound_95(2, 6));
  std::vector<std::uint64_t> seeds;
  for (const DiveEnd& end : series.worst_first) seeds.push_back(end.seed);
  EXPECT_EQ(seeds, (std::vector<std::uint64_t>{11, 9, 10, 7, 8, 12}));
}

TEST(DiveSummary, HasThePercentilesOfTheClearance) {
  std::vector<DiveEnd> ends;
  for (int i = 0; i <= 100; ++i) ends.push_back(ended(1 + i, "success", (100 - i) / 100.0));
  const DiveSeries::Clearance clearance = summarise(ends).clearance_m;
  EXPECT_EQ(clearance.min, 0.0);
  EXPECT_EQ(clearance.p05, 0.05);
  EXPECT_EQ(clearance.p50, 0.5);
  const DiveSeries::Clearance open = summarise({ended(1, "success", INFINITY)}).clearance_m;
  EXPECT_EQ(open.p05, INFINITY) << "open water: no obstacle, and not a number that is none";
}

// ------------------------------------------------------------------------ the findings

// Deep in open water: some seconds outwards, and up.
Mission mission() {
  constexpr const char* kText = R"(<mission xmlns="urn:dive:mission:1" id="out">
    <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
    <map file="none.sdf" fixes="off"/>
    <start x="0" y="0" z="2" z_units="DEPTH" heading_deg="90"/>
    <limits max_depth="8" min_altitude="0" clearance="0.8" mission_timeout="120"
            battery_reserve="0.2"/>
    <states initial="out">
      <goto id="out" x="3" y="0" z="2" z_units="DEPTH" timeout="100" on_timeout="up">
        <transition event="done.state.out" target="up"/>
      </goto>
      <surface id="up"><transition event="done.state.up" target="surfaced"/></surface>
      <final id="surfaced"/>
    </states>
  </mission>)";
  Diagnostics diagnostics;
  return parse_mission(SourceText("out.xml", kText), diagnostics, MapFile::kNotNeeded).value();
}

std::vector<Diagnostic> findings(std::vector<DiveEnd> ends) {
  Diagnostics diagnostics;
  check_dives(summarise(std::move(ends)), mission(), diagnostics);
  return {diagnostics.list().begin(), diagnostics.list().end()};
}

TEST(DiveFindings, AreNoneForDivesAsPlanned) { EXPECT_TRUE(findings(successes(30)).empty()); }

TEST(DiveFindings, HaveAnErrorForOneCollisionInAHundred) {
  std::vector<DiveEnd> ends = successes(100);
  ends[60] = ended(67, "failure", 0.0, 1);
  const std::vector<Diagnostic> found = findings(ends);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].code, "CHK-DIVE");
  EXPECT_EQ(found[0].severity, Severity::kError);
  EXPECT_THAT(found[0].message, AllOf(HasSubstr("1 of 100 simulated dives collided"),
                                      HasSubstr("at most 4.7 % of dives"),  // 4.656 %
                                      HasSubstr("cause of 67")));
  EXPECT_THAT(found[0].hint, EndsWith("dive run m.xml --seed 67"));
}

TEST(DiveFindings, HaveAWarningForAnAbortedDiveInTwentyAndAnErrorForMore) {
  std::vector<DiveEnd> ends = successes(20);
  ends[5] = ended(12, "aborted", 0.6);
  const std::vector<Diagnostic> rare = findings(ends);
  ASSERT_EQ(rare.size(), 1U);
  EXPECT_EQ(rare[0].code, "CHK-DIVE-ABORTED");
  EXPECT_EQ(rare[0].severity, Severity::kWarning);
  EXPECT_THAT(rare[0].message, AllOf(HasSubstr("1 of 20 simulated dives"), HasSubstr("seed 12"),
                                     HasSubstr("state_aborted (aborted): cause of 12")));
  EXPECT_THAT(rare[0].hint, EndsWith("dive run m.xml --seed 12"));

  ends.pop_back();
  const std::vector<Diagnostic> often = findings(ends);
  ASSERT_EQ(often.size(), 1U);
  EXPECT_EQ(often[0].severity, Severity::kError);
  EXPECT_THAT(often[0].message, HasSubstr("more than one in twenty"));
}

TEST(DiveFindings, HaveAnErrorIfTheFirstDiveIsAbortedAndNameIt) {
  std::vector<DiveEnd> ends = successes(50);
  ends[0] = ended(7, "held", 2.0);
  ends[9] = ended(16, "aborted", 0.6);
  const std::vector<Diagnostic> found = findings(ends);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].code, "CHK-DIVE-ABORTED");
  EXPECT_EQ(found[0].severity, Severity::kError);
  EXPECT_THAT(found[0].message, HasSubstr("2 of 50 simulated dives"));
  EXPECT_THAT(found[0].hint, EndsWith("--seed 7"));
}

TEST(DiveFindings, NameAnAbortedDiveBesideACollision) {
  std::vector<DiveEnd> ends = successes(50);
  ends[8] = ended(15, "aborted", 0.6);
  ends[9] = ended(16, "failure", 0.0, 1);
  const std::vector<Diagnostic> found = findings(ends);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_THAT(found[0].hint, EndsWith("--seed 16"));
  EXPECT_EQ(found[1].code, "CHK-DIVE-ABORTED");
  EXPECT_THAT(found[1].hint, EndsWith("--seed 15"));
}

TEST(DiveFindings, HaveAWarningIfOneDiveInTwentyIsNear) {
  std::vector<DiveEnd> ends = successes(100);
  for (std::size_t i = 20; i < 24; ++i) ends[i] = ended(7 + i, "success", 0.3);
  EXPECT_TRUE(findings(ends).empty()) << "fewer than a twentieth";
  for (std::size_t i = 24; i < 26; ++i) ends[i] = ended(7 + i, "success", 0.2);
  ends[0] = ended(7, "success", 0.39);
  const std::vector<Diagnostic> found = findings(ends);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].code, "CHK-DIVE-CLEARANCE");
  EXPECT_EQ(found[0].severity, Severity::kWarning);
  EXPECT_THAT(found[0].message,
              AllOf(HasSubstr("0.30 m"), HasSubstr("(0.8 m)"), HasSubstr("0.20 m from 'rock'")));
  EXPECT_THAT(found[0].hint, EndsWith("--seed 31"));
}

// ------------------------------------------------------------------------ the dives

vehicle::Model model() {
  Diagnostics diagnostics;
  return vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics).value();
}

// A wall beside the path, so that there is a clearance to compare.
planning::World beside_a_wall() {
  planning::World world;
  world.obstacles.push_back({"wall", planning::Box{{20, 1, 20}}, Pose{{0, 2, -10}}});
  return world;
}

class SetClock final : public Clock {
 public:
  [[nodiscard]] Utime now() override { return from_seconds(now_s); }
  double now_s = 100.0;
};

/// Dives that take `dive_s` each by the clock.
SeriesResult dived(std::optional<int> dives, int threads, double dive_s) {
  SetClock clock;
  double ended = 0.0;
  return dive_series(mission(), beside_a_wall(), model(), {}, {dives, threads, 20.0}, clock,
                     [&](double done, double, const std::string&, double) {
                       clock.now_s += dive_s * (done - ended);
                       ended = done;
                     });
}

using Figures = std::tuple<std::uint64_t, std::string, double, double, std::string>;

std::vector<Figures> figures_of(const DiveSeries& series) {
  std::vector<Figures> figures;
  for (const DiveEnd& end : series.worst_first) {
    figures.emplace_back(end.seed, end.outcome, end.nearest.clearance_m, end.nearest.t_s,
                         end.command);
  }
  return figures;
}

TEST(DiveSeriesByTime, StartsDivesForTenSecondsAndAtLeastTen) {
  EXPECT_EQ(dived({}, 1, 0.75).series.dives, 14) << "the last one starts after 9.75 s";
  EXPECT_EQ(dived({}, 1, 60.0).series.dives, 10);
  EXPECT_EQ(dived(3, 1, 60.0).series.dives, 3);
}

TEST(DiveSeriesByTime, IsRepeatedByItsNumberOfDivesOnAnyNumberOfThreads) {
  const SeriesResult timed = dived({}, 2, 0.9);
  const DiveSeries& series = timed.series;
  EXPECT_GE(series.dives, 10);
  for (const int threads : {1, 3}) {
    const SeriesResult again = dived(series.dives, threads, 60.0);
    EXPECT_EQ(figures_of(again.series), figures_of(series)) << threads << " threads";
    EXPECT_EQ(again.nominal.under_overhead, timed.nominal.under_overhead);
    EXPECT_EQ(again.nominal.result.duration_s, timed.nominal.result.duration_s);
  }
}

TEST(DiveSeriesByNumber, DrawsOtherErrorsWithEverySeedAndBeginsWithTheNominalDive) {
  const SeriesResult three = dived(3, 1, 0.0);
  std::set<double> clearances;
  for (const DiveEnd& end : three.series.worst_first) clearances.insert(end.nearest.clearance_m);
  EXPECT_EQ(clearances.size(), 3U);
  const DiveResult alone =
      simulate_dive(mission(), beside_a_wall(), model(), DiveSettings{}, nullptr);
  EXPECT_EQ(three.nominal.result.duration_s, alone.duration_s);
  EXPECT_EQ(three.nominal.result.nearest.clearance_m, alone.nearest.clearance_m);
  EXPECT_EQ(three.nominal.under_overhead.size(),
            static_cast<std::size_t>(std::lround(alone.duration_s / 0.02)) + 1);
}

/// Notes the progress, and sets a clock by it.
class Progress final : public CheckObserver {
 public:
  void on_step(const std::string& what) override { steps.push_back(what); }
  void on_progress(double done, double total, const std::string& unit, double share) override {
    EXPECT_LE(done, total);
    EXPECT_GE(share, 0.0);
    EXPECT_LE(share, 1.0);
    if (unit != "dives") return;
    clock.now_s += 0.035;
    last = {done, total, share};
  }
  SetClock clock;
  std::vector<std::string> steps;
  std::array<double, 3> last = {};
};

TEST(DiveSeriesByTime, ReportsItsProgressUpToTheLastDive) {
  CheckOptions options;
  options.dives.reset();
  Progress progress;
  Diagnostics diagnostics;
  const CheckReport report = check_mission(mission(), beside_a_wall(), model(), options,
                                           diagnostics, progress, progress.clock);
  ASSERT_TRUE(report.dives);
  EXPECT_GT(report.dives->dives, 10);
  EXPECT_EQ(progress.steps.back(), "simulated dives for 10 s, at least 10");
  EXPECT_EQ(progress.last, (std::array<double, 3>{static_cast<double>(report.dives->dives),
                                                  static_cast<double>(report.dives->dives), 1.0}));
}

TEST(DiveSeriesInCheck, IsAnErrorWithTheCommandIfTheDivesAreAborted) {
  CheckOptions options;
  options.dives = 2;
  options.dive.seed = 5;
  options.dive.conditions = simulated_conditions(mission());
  options.dive.faults = {{FaultKind::kLeak, 3.0}};
  SetClock clock;
  CheckObserver observer;
  Diagnostics diagnostics;
  const CheckReport report =
      check_mission(mission(), beside_a_wall(), model(), options, diagnostics, observer, clock);
  ASSERT_EQ(diagnostics.error_count(), 1U);
  const Diagnostic& error = diagnostics.list().back();
  EXPECT_EQ(error.code, "CHK-DIVE-ABORTED");
  EXPECT_THAT(error.message, HasSubstr("2 of 2 simulated dives"));
  EXPECT_THAT(error.message, HasSubstr("leak"));
  EXPECT_THAT(error.hint, EndsWith("dive run out.xml --seed 5 --fault leak@3"));
  ASSERT_TRUE(report.dive);
  EXPECT_EQ(report.dive->outcome, "aborted");
  EXPECT_EQ(report.dives->surfaced, 2);
}

}  // namespace
}  // namespace dive::mission
