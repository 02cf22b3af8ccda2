#pragma once
// Many simulated dives of one mission with consecutive seeds. Each draws the errors of its
// conditions by its seed: the dives show how often such a vehicle collides and how near it passes.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/diagnostic.h"
#include "mission/check/fault_matrix.h"
#include "mission/simulation/simulated_dive.h"

namespace dive::mission {

inline constexpr double kSeriesSeconds = 10.0;  ///< Wall-clock time for starting dives.
inline constexpr int kMinTimedDives = 10;       ///< Least number of dives in a series by time.
inline constexpr int kMaxDives = 100'000;

struct SeriesOptions {
  /// 1 to kMaxDives; absent: a new dive starts until kSeriesSeconds have passed and kMinTimedDives
  /// have started.
  std::optional<int> dives = 1;
  int threads = 1;
  double expected_s = 1.0;  ///< Expected duration of a dive, for the progress; > 0.
};

/// What is kept of a dive.
struct DiveEnd {
  std::uint64_t seed = 1;
  std::string outcome;  ///< Outcome, final state and cause as in DiveResult.
  std::string final_state;
  std::string cause;
  std::size_t collisions = 0;
  bool surfaced = false;
  NearestApproach nearest;
  std::string command;  ///< Repeats the dive: run_command_for().
};

struct DiveSeries {
  /// Clearance of the dives, m: the least, the 5th percentile and the median (nearest ranks).
  struct Clearance {
    double min = 0.0;
    double p05 = 0.0;
    double p50 = 0.0;
  };

  std::uint64_t first_seed = 1;
  int dives = 0;
  int successes = 0;
  int surfaced = 0;
  int collisions = 0;               ///< Number of dives with at least one.
  double collision_bound_95 = 1.0;  ///< upper_bound_95() of the collision rate.
  Clearance clearance_m;
  /// All dives: those with most collisions first, then those without success, then those with the
  /// least clearance; by seed where these are equal.
  std::vector<DiveEnd> worst_first;

  /// Number of dives that ended otherwise than planned, without a collision.
  [[nodiscard]] int aborted() const { return dives - successes - collisions; }
};

/// The exact one-sided upper 95 % confidence bound of the probability p of an event that occurred
/// `events` times in `trials` > 0 independent trials: the p at which `events` or fewer have a
/// probability of 5 %. (Clopper and Pearson 1934, "The use of confidence or fiducial limits
/// illustrated in the case of the binomial", Biometrika 26 (4), 404-413.)
[[nodiscard]] double upper_bound_95(int events, int trials);

/// At least one dive, in the order of consecutive seeds.
[[nodiscard]] DiveSeries summarise(std::vector<DiveEnd> ends);

/// Progress as CheckObserver::on_progress() takes it, from one thread at a time.
using SeriesObserver =
    std::function<void(double done, double total, const std::string& unit, double share)>;

struct SeriesResult {
  NominalDive nominal;  ///< The first dive.
  DiveSeries series;
};

/// Dives with the seeds from `settings.seed` on. The result depends on the number of dives, and not
/// on threads or `clock`, which only decide that number if the options leave it open. Of a dive
/// other than the first only its DiveEnd is kept. `settings.triangles` are not used, because every
/// seed draws another world; its functions must be callable from several threads at once.
[[nodiscard]] SeriesResult dive_series(const Mission& mission, const planning::World& world,
                                       const vehicle::Model& model, const DiveSettings& settings,
                                       const SeriesOptions& options, Clock& clock,
                                       const SeriesObserver& observer);

/// Reports collisions, dives that ended otherwise than planned, and small clearances (CHK-DIVE,
/// CHK-DIVE-ABORTED, CHK-DIVE-CLEARANCE).
void check_dives(const DiveSeries& series, const Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
