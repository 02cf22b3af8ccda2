#include "mission/check/fault_matrix.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <thread>

namespace dive::mission {
namespace {

constexpr double kRest = 30.0;          // s within half a metre: somebody can come and fetch it
constexpr double kSurfacedDepth = 0.5;  // m

struct Stay {
  std::string state;
  double middle_s = 0.0;
};

// The leaves that a dive spent time in.
std::vector<Stay> stays_of(const DiveResult& nominal) {
  std::vector<Stay> stays;
  const std::vector<TimedTransition>& transitions = nominal.transitions;
  for (std::size_t i = 0; i < transitions.size(); ++i) {
    const double begin = transitions[i].t_s;
    const double end = i + 1 < transitions.size() ? transitions[i + 1].t_s : nominal.duration_s;
    if (end - begin < 2.0 * vehicle::Simulator::kTick) continue;  // passed through
    stays.push_back({transitions[i].record.to, 0.5 * (begin + end)});
  }
  return stays;
}

bool is_of_cameras(FaultKind kind) {
  return kind >= FaultKind::kCameraBlackout && kind <= FaultKind::kCameraOneEye;
}

// Those that a vehicle must survive, but for those of what it does not use.
std::vector<FaultKind> faults_of(const Mission& mission) {
  std::vector<FaultKind> kinds;
  for (std::size_t i = 0; i < kSurvivableCount; ++i) {
    const auto kind = static_cast<FaultKind>(i);
    const bool is_used = is_of_cameras(kind)               ? goes_by_sight(mission)
                         : kind == FaultKind::kRangeSilent ? mission.unknown.has_value()
                         : kind == FaultKind::kRangeFrozen ? has_range_camera(mission)
                                                           : true;
    if (is_used) kinds.push_back(kind);
  }
  return kinds;
}

FaultVerdict dive_one(const FaultCase& fault, const Mission& mission, const planning::World& world,
                      const vehicle::Model& model, DiveSettings settings) {
  settings.faults = fault.faults;
  settings.rest_s = kRest;
  FaultVerdict verdict{fault, simulate_dive(mission, world, model, settings, nullptr)};
  verdict.surfaced =
      verdict.dive.outcome != "failure" && verdict.dive.final_depth_m < kSurfacedDepth;
  verdict.held = verdict.dive.outcome == "held" && !verdict.surfaced;
  return verdict;
}

}  // namespace

std::vector<FaultCase> every_fault_in_every_state(const Mission& mission,
                                                  const DiveResult& nominal) {
  std::vector<FaultCase> cases;
  for (const Stay& stay : stays_of(nominal)) {
    for (const FaultKind kind : faults_of(mission)) {
      cases.push_back({stay.state, {{kind, stay.middle_s}}});
    }
  }
  return cases;
}

std::vector<FaultCase> every_pair_in_every_state(const Mission& mission,
                                                 const DiveResult& nominal) {
  const std::vector<FaultKind> kinds = faults_of(mission);
  std::vector<FaultCase> cases;
  for (const Stay& stay : stays_of(nominal)) {
    for (std::size_t a = 0; a < kinds.size(); ++a) {
      for (std::size_t b = a + 1; b < kinds.size(); ++b) {
        cases.push_back({stay.state, {{kinds[a], stay.middle_s}, {kinds[b], stay.middle_s}}});
      }
    }
  }
  return cases;
}

std::vector<FaultVerdict> dive_with_faults(const std::vector<FaultCase>& cases,
                                           const Mission& mission, const planning::World& world,
                                           const vehicle::Model& model,
                                           const DiveSettings& settings, int threads,
                                           const std::function<void(std::size_t)>& progress) {
  std::vector<FaultVerdict> verdicts(cases.size());
  std::atomic<std::size_t> next = 0;
  std::mutex telling;
  std::size_t done = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size(); i = next++) {
      verdicts[i] = dive_one(cases[i], mission, world, model, settings);
      const std::lock_guard lock(telling);
      progress(++done);
    }
  };
  std::vector<std::jthread> workers;
  for (int i = 0; i < threads; ++i) workers.emplace_back(work);
  workers.clear();  // joins
  return verdicts;
}

}  // namespace dive::mission
