#include "mission/executive/checkpoint.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"
#include "vehicle/command_timing.h"
#include "vehicle/going_home.h"

namespace dive::mission {
namespace {

using statechart::StateId;

constexpr double kDriftWhileAway = 0.2;  // m/s, one sigma, until the vehicle has stopped
constexpr double kSwimsOn = to_seconds(vehicle::kSwimsOn);  // s after a checkpoint
constexpr double kStops = 1.0;  // time constant, s, with which it then comes to rest

}  // namespace

double gap_of(const Resume& resume, Utime now, double longest_s) {
  const double by_clock = to_seconds(now - resume.checkpoint.utime);
  return resume.gap_s.value_or(by_clock >= 0.0 ? by_clock : longest_s + 1.0);
}

Drift drift_in(double gap_s, const Checkpoint& checkpoint, const Eigen::Vector2d& current_W) {
  const double stopping = 1.0 - std::exp(-std::max(gap_s - kSwimsOn, 0.0) / kStops);
  const double swam_s = std::min(gap_s, kSwimsOn) + kStops * stopping;
  const Eigen::Vector3d carried_W(current_W.x(), current_W.y(), 0.0);
  const Eigen::Vector3d swims_W = checkpoint.v_W - carried_W;
  const double swam = (checkpoint.X_WB.q.conjugate() * swims_W).x();
  const double sigma_m = kDriftWhileAway * std::min(gap_s, vehicle::kComesToRest) +
                         vehicle::kStopSigma * std::max(gap_s - vehicle::kComesToRest, 0.0);
  return {swims_W.head<2>() * swam_s + current_W * gap_s, sigma_m, swam * (1.0 - stopping),
          swam * stopping};
}

void keep_memory(const statechart::Interpreter::Memory& memory, const statechart::Chart& chart,
                 Checkpoint& checkpoint) {
  const auto id_of = [&](StateId state) -> const std::string& {
    return chart.states[static_cast<std::size_t>(state)].id;
  };
  for (const StateId state : memory.active) checkpoint.active.push_back(id_of(state));
  for (std::size_t i = 0; i < memory.history.size(); ++i) {
    for (const StateId state : memory.history[i]) {
      checkpoint.history[chart.states[i].id].push_back(id_of(state));
    }
  }
}

statechart::Interpreter::Memory memory_of(const Checkpoint& checkpoint,
                                          const statechart::Chart& chart) {
  const auto find = [&](const std::string& id) {
    const StateId state = chart.find(id);
    DIVE_DEMAND(state >= 0);
    return state;
  };
  statechart::Interpreter::Memory memory;
  memory.history.resize(chart.states.size());
  for (const std::string& id : checkpoint.active) memory.active.push_back(find(id));
  for (const auto& [id, states] : checkpoint.history) {
    for (const std::string& state : states) {
      memory.history[static_cast<std::size_t>(find(id))].push_back(find(state));
    }
  }
  return memory;
}

}  // namespace dive::mission
