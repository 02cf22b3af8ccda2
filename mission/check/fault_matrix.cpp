#include "mission/check/fault_matrix.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <tuple>

#include <fmt/format.h>

#include "common/parallel.h"
#include "common/random.h"
#include "vehicle/going_home.h"

namespace dive::mission {
namespace {

constexpr double kEdge = 1.0;  // s: maximum distance of an edge instant from entry or exit

/// An atomic state in which the nominal dive stayed, as inclusive control ticks.
struct Stay {
  std::string state;
  int first = 0;
  int last = 0;
};

int tick_at(double t_s) { return static_cast<int>(std::lround(t_s / vehicle::Simulator::kTick)); }

// By division, because a time written with two decimals and read again must be the same.
double time_of(int tick) {
  constexpr double kTicksPerSecond = 50.0;
  static_assert(kTicksPerSecond * vehicle::Simulator::kTick == 1.0);
  return tick / kTicksPerSecond;
}

std::vector<Stay> stays_of(const DiveResult& nominal) {
  std::vector<Stay> stays;
  const std::vector<TimedTransition>& transitions = nominal.transitions;
  for (std::size_t i = 0; i < transitions.size(); ++i) {
    const double end = i + 1 < transitions.size() ? transitions[i + 1].t_s : nominal.duration_s;
    const Stay stay{transitions[i].record.to, tick_at(transitions[i].t_s) + 1, tick_at(end) - 1};
    if (stay.first <= stay.last) stays.push_back(stay);
  }
  return stays;
}

bool is_of_cameras(FaultKind kind) {
  return kind >= FaultKind::kCameraBlackout && kind <= FaultKind::kCameraRightMissing;
}

// The faults that the vehicle must survive, without faults of devices that it does not use.
std::vector<FaultKind> faults_of(const Mission& mission) {
  std::vector<FaultKind> kinds;
  for (std::size_t i = 0; i < kSurvivableCount; ++i) {
    const auto kind = static_cast<FaultKind>(i);
    const bool is_used = is_of_cameras(kind) ? uses_visual_inertial(mission)
                         : kind == FaultKind::kRangeSilent
                             ? mission.unknown.has_value() || uses_range_camera(mission)
                         : kind == FaultKind::kRangeFrozen ? uses_range_camera(mission)
                                                           : true;
    if (is_used) kinds.push_back(kind);
  }
  return kinds;
}

using Kinds = std::vector<FaultKind>;

std::vector<Kinds> pairs_of(const Kinds& kinds) {
  std::vector<Kinds> pairs;
  for (std::size_t a = 0; a < kinds.size(); ++a) {
    for (std::size_t b = a + 1; b < kinds.size(); ++b) pairs.push_back({kinds[a], kinds[b]});
  }
  return pairs;
}

int draw_between(Random& random, double low, double high) {
  return static_cast<int>(std::floor(random.uniform(low, high)));
}

// Ticks in order of interest, overheads aside: the edges first.
std::vector<int> draw_instants(const Stay& stay, int count, Random& random) {
  const double begin = stay.first;
  const double end = stay.last + 1;  // the first tick outside
  if (count == 1) return {draw_between(random, begin, end)};
  const double edge = std::clamp(0.25 * (end - begin), 1.0, kEdge / vehicle::Simulator::kTick);
  std::vector<int> ticks = {draw_between(random, begin, begin + edge),
                            draw_between(random, end - edge, end)};
  const int between = count - 2;
  const double stratum = (end - begin - 2.0 * edge) / std::max(between, 1);
  for (int i = 0; i < between && stratum > 0.0; ++i) {
    const double low = begin + edge + i * stratum;
    ticks.push_back(draw_between(random, low, low + stratum));
  }
  return ticks;
}

// A case and its position in the order of the dives.
struct Ranked {
  FaultCase fault;
  int round = 0;  ///< Number of earlier instants of the same faults in the same stay.
};

/// All instants of the same faults in one stay.
void append_cases(const Stay& stay, const Kinds& kinds, int instants, const NominalDive& nominal,
                  Random random, std::vector<Ranked>& ranked) {
  const auto is_under = [&](int tick) {
    const auto index = static_cast<std::size_t>(tick);
    return index < nominal.under_overhead.size() && nominal.under_overhead[index];
  };
  std::vector<int> ticks = draw_instants(stay, instants, random);
  std::ranges::stable_partition(ticks, is_under);
  int round = 0;
  for (const int tick : ticks) {
    FaultCase fault{stay.state, {}, is_under(tick)};
    for (const FaultKind kind : kinds) fault.faults.push_back({kind, time_of(tick)});
    ranked.push_back({std::move(fault), round++});
  }
}

// Numbers every stay and set of faults, so that their random draws are independent.
std::uint64_t stream_of(std::size_t stay, const Kinds& kinds) {
  std::uint64_t stream = stay;
  for (const FaultKind kind : kinds) {
    stream = stream * (kFaultCount + 1) + static_cast<std::uint64_t>(kind) + 1;
  }
  return stream;
}

FaultResult dive_one(const FaultCase& fault, const Mission& mission, const planning::World& world,
                     const vehicle::Model& model, DiveSettings settings) {
  settings.faults = fault.faults;
  FaultResult result{fault, simulate_dive(mission, world, model, settings, nullptr)};
  result.dive.observed_map = {};
  result.dive.observed_points = {};
  result.surfaced = has_surfaced(result.dive);
  result.held = result.dive.outcome == "held" && !result.surfaced;
  return result;
}

}  // namespace

std::vector<FaultCase> draw_fault_cases(const Mission& mission, const NominalDive& nominal,
                                        const FaultDraw& draw) {
  const std::vector<Stay> stays = stays_of(nominal.result);
  const Kinds all = faults_of(mission);
  std::vector<Ranked> ranked;
  for (std::size_t i = 0; i < stays.size(); ++i) {
    const auto append = [&](const Kinds& kinds, int instants) {
      append_cases(stays[i], kinds, instants, nominal, Random(draw.seed, stream_of(i, kinds)),
                   ranked);
    };
    for (const FaultKind kind : all) append({kind}, draw.instants);
    if (draw.pair_instants == 0) continue;
    for (const Kinds& pair : pairs_of(all)) append(pair, draw.pair_instants);
  }
  std::ranges::stable_sort(ranked, {}, [](const Ranked& one) {
    return std::tuple(one.fault.faults.size(), one.round, !one.fault.under_overhead);
  });
  std::vector<FaultCase> cases;
  for (Ranked& one : ranked) cases.push_back(std::move(one.fault));
  return cases;
}

bool has_surfaced(const DiveResult& dive) {
  return dive.outcome != "failure" && dive.final_depth_m < vehicle::kCheckedSurfacedDepth;
}

std::string describe(const FaultResult& result) {
  std::string faults;
  for (const Fault& fault : result.fault.faults) {
    faults += fmt::format("{}{}", faults.empty() ? "" : " and ", to_string(fault.kind));
  }
  const DiveResult& dive = result.dive;
  return fmt::format("{} at {:.2f} s in '{}': {} in {} at {:.1f} m depth after {:.0f} s ({})",
                     faults, result.fault.faults.front().at_s, result.fault.state, dive.outcome,
                     dive.final_state, dive.final_depth_m, dive.duration_s, dive.cause);
}

FaultProgress::FaultProgress(const std::vector<FaultCase>& cases) : left_(cases.size()) {
  for (const FaultCase& one : cases) before_faults_s_ += one.faults.front().at_s;
}

void FaultProgress::add(const FaultResult& result) {
  const double at_s = result.fault.faults.front().at_s;
  dived_s_ += result.dive.duration_s;
  after_faults_s_ += result.dive.duration_s - at_s;
  before_faults_s_ -= at_s;
  ++ended_;
  --left_;
}

double FaultProgress::share() const {
  if (ended_ == 0) return 0.0;
  const double mean_after_s = after_faults_s_ / static_cast<double>(ended_);
  const double left_s = before_faults_s_ + static_cast<double>(left_) * mean_after_s;
  return left_ == 0 ? 1.0 : dived_s_ / (dived_s_ + left_s);
}

std::vector<FaultResult> dive_with_faults(const std::vector<FaultCase>& cases,
                                          const Mission& mission, const planning::World& world,
                                          const vehicle::Model& model, const DiveSettings& settings,
                                          int threads, const FaultObserver& observer) {
  std::vector<FaultResult> results(cases.size());
  DiveSettings shared = settings;
  if (!shared.triangles) shared.triangles.emplace(simulated_world(world, shared));
  std::mutex observing;
  std::size_t done = 0;
  run_in_parallel(cases.size(), threads, [&](std::size_t i) {
    results[i] = dive_one(cases[i], mission, world, model, shared);
    const std::lock_guard lock(observing);
    observer(++done, results[i]);
  });
  return results;
}

}  // namespace dive::mission
