#include "mission/check/dive_series.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/parallel.h"
#include "mission/check/reproduce.h"
#include "planning/world/overhead.h"

namespace dive::mission {
namespace {

constexpr double kProgressPeriod = 1.0;  // s of dive time
constexpr int kMinDivesPerAborted = 20;
constexpr double kMinClearanceShare = 0.5;  // of the required clearance

/// Probability of at most `events` in `trials`, each with probability p in (0, 1). The terms are
/// summed by their logarithms: the first of many trials is below the least double.
double binomial_cdf(int events, int trials, double p) {
  const double log_odds = std::log(p) - std::log1p(-p);
  double log_term = trials * std::log1p(-p);
  double sum = std::exp(log_term);
  for (int i = 1; i <= events; ++i) {
    log_term += std::log(static_cast<double>(trials - i + 1) / i) + log_odds;
    sum += std::exp(log_term);
  }
  return sum;
}

/// The value of the nearest rank; `sorted` is not empty.
double quantile(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(
      std::lround(share * static_cast<double>(sorted.size() - 1)))];
}

DiveSeries::Clearance clearance_of(const std::vector<DiveEnd>& ends) {
  std::vector<double> sorted;
  for (const DiveEnd& end : ends) sorted.push_back(end.nearest.clearance_m);
  std::ranges::sort(sorted);
  return {sorted.front(), quantile(sorted, 0.05), quantile(sorted, 0.5)};
}

DiveEnd end_of(const DiveResult& result, const Mission& mission, const DiveSettings& settings) {
  return {settings.seed,
          result.outcome,
          result.final_state,
          result.cause,
          result.collisions.size(),
          has_surfaced(result),
          result.nearest,
          run_command_for(mission, settings)};
}

/// Decides when the series ends, and reports its progress. Shares of the work are measured in
/// simulated seconds, because ten long dives on two threads end rarely.
class SeriesProgress {
 public:
  SeriesProgress(const SeriesOptions& options, Clock& clock, const SeriesObserver& observer)
      : options_(options),
        clock_(clock),
        observer_(observer),
        began_(clock.now()),
        count_(options.dives) {}

  /// True if another dive starts.
  [[nodiscard]] bool start() {
    const std::lock_guard lock(mutex_);
    settle();
    if (count_ && started_ >= *count_) return false;
    ++started_;
    return true;
  }

  /// A dive has advanced by `dived_s`.
  void advance(double dived_s) {
    const std::lock_guard lock(mutex_);
    dived_s_ += dived_s;
    report();
  }

  /// A dive of `duration_s` has ended; it has advanced by `dived_s` since it last did.
  void end(double duration_s, double dived_s) {
    const std::lock_guard lock(mutex_);
    dived_s_ += dived_s;
    ended_s_ += duration_s;
    ++ended_;
    report();
  }

 private:
  [[nodiscard]] double elapsed_share() const {
    return to_seconds(clock_.now() - began_) / kSeriesSeconds;
  }

  /// Fixes the number of dives as soon as no more may start.
  void settle() {
    if (count_ || started_ < kMinTimedDives) return;
    if (started_ == kMaxDives || elapsed_share() >= 1.0) count_ = started_;
  }

  /// Share of the dives that will certainly be dived.
  [[nodiscard]] double dived_share() const {
    const int certain = count_.value_or(kMinTimedDives);
    if (ended_ >= certain) return 1.0;
    const double mean_s = ended_ > 0 ? ended_s_ / ended_ : options_.expected_s;
    return std::min(dived_s_ / (mean_s * certain), 1.0);
  }

  void report() {
    if (options_.dives == 1) {
      observer_(dived_s_, options_.expected_s, "s of the dive", dived_s_ / options_.expected_s);
      return;
    }
    settle();
    double share = dived_share();
    double total = count_.value_or(kMinTimedDives);
    if (!count_) {
      share = std::min(share, elapsed_share());
      if (share > 0.0) total = std::max(total, std::round(ended_ / share));
    }
    observer_(ended_, total, "dives", share);
  }

  const SeriesOptions& options_;
  Clock& clock_;
  const SeriesObserver& observer_;
  const Utime began_;
  std::mutex mutex_;
  std::optional<int> count_;  ///< Number of dives; absent while time decides it.
  int started_ = 0;
  int ended_ = 0;
  double dived_s_ = 0.0;  ///< Sum over all dives.
  double ended_s_ = 0.0;  ///< Sum over the dives that have ended.
};

std::string hint_for(const DiveEnd& end) { return "reproduce it with: " + end.command; }

void report_aborted(const DiveSeries& series, const Mission& mission, Diagnostics& diagnostics) {
  if (series.aborted() == 0) return;
  const auto is_aborted = [](const DiveEnd& end) {
    return end.outcome != "success" && end.collisions == 0;
  };
  const DiveEnd* example = &series.worst_first[static_cast<std::size_t>(series.collisions)];
  const auto first = std::ranges::find(series.worst_first, series.first_seed, &DiveEnd::seed);
  const bool is_first = is_aborted(*first);
  if (is_first) example = &*first;
  const bool is_often = series.dives < kMinDivesPerAborted * series.aborted();
  const std::string message = fmt::format(
      "{} of {} simulated dives ended otherwise than planned{}; the dive with seed {} ended in {} "
      "({}): {}",
      series.aborted(), series.dives,
      is_first   ? ", and the first is one of them"
      : is_often ? ", more than one in twenty"
                 : "",
      example->seed, example->final_state, example->outcome, example->cause);
  if (is_first || is_often) {
    diagnostics.error("CHK-DIVE-ABORTED", mission.source, mission.initial.span, message,
                      hint_for(*example));
  } else {
    diagnostics.warning("CHK-DIVE-ABORTED", mission.source, mission.initial.span, message,
                        hint_for(*example));
  }
}

/// One dive; `nominal` is absent except for the first.
DiveEnd dive_one(const Mission& mission, const planning::World& world, const vehicle::Model& model,
                 const DiveSettings& settings, NominalDive* nominal, SeriesProgress& progress) {
  std::optional<planning::OverheadIndex> overheads;
  const double radius = model.hull.radius();
  double reported_s = 0.0;
  if (nominal) {
    overheads.emplace(world);
    nominal->under_overhead.push_back(false);  // tick 0 is before the first step
  }
  DiveResult result = simulate_dive(
      mission, world, model, settings,
      [&](const StepInputs& inputs, const StepOutputs&, const vehicle::GroundTruth& truth,
          const TickContacts&) {
        if (overheads) {
          nominal->under_overhead.push_back(overheads->is_above(truth.X_WB.p, radius));
        }
        const double now_s = to_seconds(inputs.now);
        if (now_s < reported_s + kProgressPeriod) return;
        progress.advance(now_s - reported_s);
        reported_s = now_s;
      });
  progress.end(result.duration_s, result.duration_s - reported_s);
  DiveEnd end = end_of(result, mission, settings);
  if (nominal) nominal->result = std::move(result);
  return end;
}

}  // namespace

double upper_bound_95(int events, int trials) {
  DIVE_DEMAND(0 <= events && events <= trials && trials > 0);
  if (events == trials) return 1.0;
  double low = static_cast<double>(events) / trials;
  double high = 1.0;
  for (int i = 0; i < 60; ++i) {  // halvings: more than a double's digits
    const double middle = 0.5 * (low + high);
    (binomial_cdf(events, trials, middle) > 0.05 ? low : high) = middle;
  }
  return high;
}

DiveSeries summarise(std::vector<DiveEnd> ends) {
  DIVE_DEMAND(!ends.empty());
  DiveSeries series;
  series.first_seed = ends.front().seed;
  series.dives = static_cast<int>(ends.size());
  for (const DiveEnd& end : ends) {
    series.successes += end.outcome == "success" ? 1 : 0;
    series.surfaced += end.surfaced ? 1 : 0;
    series.collisions += end.collisions > 0 ? 1 : 0;
  }
  series.collision_bound_95 = upper_bound_95(series.collisions, series.dives);
  series.clearance_m = clearance_of(ends);
  std::ranges::stable_sort(ends, std::less<>{}, [](const DiveEnd& end) {
    return std::tuple(-static_cast<double>(end.collisions), end.outcome == "success",
                      end.nearest.clearance_m);
  });
  series.worst_first = std::move(ends);
  return series;
}

SeriesResult dive_series(const Mission& mission, const planning::World& world,
                         const vehicle::Model& model, const DiveSettings& settings,
                         const SeriesOptions& options, Clock& clock,
                         const SeriesObserver& observer) {
  DIVE_DEMAND(!options.dives || (0 < *options.dives && *options.dives <= kMaxDives));
  DIVE_DEMAND(options.threads > 0 && options.expected_s > 0.0);
  SeriesProgress progress(options, clock, observer);
  NominalDive nominal;
  std::mutex storing;
  std::vector<DiveEnd> ends;
  run_in_parallel_while([&](std::size_t) { return progress.start(); }, options.threads,
                        [&](std::size_t i) {
                          DiveSettings own = settings;
                          own.seed = settings.seed + i;
                          own.triangles.reset();
                          DiveEnd end = dive_one(mission, world, model, own,
                                                 i == 0 ? &nominal : nullptr, progress);
                          const std::lock_guard lock(storing);
                          ends.resize(std::max(ends.size(), i + 1));
                          ends[i] = std::move(end);
                        });
  return {std::move(nominal), summarise(std::move(ends))};
}

void check_dives(const DiveSeries& series, const Mission& mission, Diagnostics& diagnostics) {
  if (series.collisions > 0) {
    const DiveEnd& worst = series.worst_first.front();
    diagnostics.error(
        "CHK-DIVE", mission.source, mission.initial.span,
        fmt::format("{} of {} simulated dives collided (at most {:.1f} % of dives collide, with 95 "
                    "% confidence); the worst, with seed {}, ended in {}: {}",
                    series.collisions, series.dives, 100.0 * series.collision_bound_95, worst.seed,
                    worst.final_state, worst.cause),
        hint_for(worst));
  }
  report_aborted(series, mission, diagnostics);
  const Located<double>& asked = mission.limits.clearance;
  if (series.collisions == 0 && series.clearance_m.p05 < kMinClearanceShare * asked.value) {
    const DiveEnd& nearest = *std::ranges::min_element(
        series.worst_first, {}, [](const DiveEnd& end) { return end.nearest.clearance_m; });
    diagnostics.warning(
        "CHK-DIVE-CLEARANCE", mission.source, asked.span,
        fmt::format("the 5th percentile of the clearance of {} simulated dives is {:.2f} m, less "
                    "than half of the required clearance ({:g} m); the dive with seed {} passes {}",
                    series.dives, series.clearance_m.p05, asked.value, nearest.seed,
                    describe(nearest.nearest)),
        hint_for(nearest));
  }
}

}  // namespace dive::mission
