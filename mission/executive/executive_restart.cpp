#include <cmath>

#include <fmt/format.h>

#include "mission/executive/behavior_factory.h"
#include "mission/executive/executive_impl.h"
#include "mission/states/atomic_state.h"
#include "vehicle/going_home.h"

namespace dive::mission {

using behaviors::Rung;

namespace {

// m/s: the vehicle comes to rest within kGivenBack from a smaller one.
constexpr double kLostSpeed = 0.1;

}  // namespace

Eigen::Vector3d Executive::Impl::first_position() const {
  if (options.resume) return options.resume->checkpoint.X_WB.p;
  return mission.start.in_world(ground_height(map.scene(), mission.start));
}

double Executive::Impl::first_sigma() const {
  return options.resume ? options.resume->checkpoint.sigma_m : mission.priors.start_m;
}

Eigen::Vector2d Executive::Impl::declared_current(Utime now) const {
  double elapsed_s = started ? to_seconds(now - started_at) : 0.0;
  if (!started && options.resume) {
    elapsed_s = options.resume->checkpoint.elapsed_s +
                gap_of(*options.resume, now, mission.max_gap_s.value);
  }
  return mission.current.value.at(elapsed_s);
}

void Executive::Impl::resume(const Resume& from) {
  const Checkpoint& checkpoint = from.checkpoint;
  const double gap_s = gap_of(from, situation.now, mission.max_gap_s.value);
  if (!from.gap_s) {
    const Drift drift = drift_in(gap_s, checkpoint, mission.current.value.at(checkpoint.elapsed_s));
    localization.dead_reckon(drift.by_W, drift.sigma_m, drift.surge);
    control.begin_at(drift.surge);
    // If the clock was set meanwhile, the gap was another: the vehicle may still have the speed
    // that is taken as lost.
    const bool may_still_move = std::abs(drift.lost) > kLostSpeed;
    given_back_at = situation.now +
                    (may_still_move ? from_seconds(vehicle::kComesToRest) : vehicle::kGivenBack);
  }
  outputs.estimate = situation.estimate = localization.update(situation.now);
  started_at = situation.now - from_seconds(checkpoint.elapsed_s + gap_s);
  overhead_monitor.restore(from.trail, from.trail_spacing_m);
  exit_path.restore(from.trail);
  assess();
  if (checkpoint.open_water_elapsed_s && !situation.open_above) {
    overhead_monitor.restore(Usable{started_at + from_seconds(*checkpoint.open_water_elapsed_s),
                                    checkpoint.open_water_battery});
  }
  ladder.restore(checkpoint.rung, checkpoint.rung_cause);
  paused = checkpoint.paused;
  imu_bias = checkpoint.imu_bias;
  behavior.restore(checkpoint.queries);
  goals_left_out = checkpoint.goals_done;
  runner.restore(checkpoint);
  goals_left_out = 0;
  outputs.transitions.push_back({"", runner.innermost(), "", "the executive was restarted", ""});
  if (checkpoint.rung < Rung::kRetrace) resume_by_policy(gap_s);
}

void Executive::Impl::resume_by_policy(double gap_s) {
  if (mission.resume == ResumePolicy::kSurface) {
    runner.set_abort_cause("restarted; the mission's <resume> specifies surface");
  } else if (gap_s > mission.max_gap_s.value) {
    runner.set_abort_cause(
        fmt::format("restarted after {:.0f} s, more than {:g} s", gap_s, mission.max_gap_s.value));
  } else {
    paused = paused || mission.resume == ResumePolicy::kHold;
    return;
  }
  runner.dispatch({kAbortEvent, runner.abort_cause()});
}

Checkpoint Executive::Impl::checkpoint() const {
  Checkpoint result;
  result.utime = situation.now;
  result.elapsed_s = to_seconds(situation.now - started_at);
  runner.save(result);
  const estimation::StateEstimate& estimate = situation.estimate;
  result.X_WB = estimate.X_WB;
  result.v_W = estimate.X_WB.q * estimate.v_WB_B;
  result.sigma_m = estimation::horizontal_sigma(estimate);
  if (const std::optional<Usable>& usable = overhead_monitor.last_in_open_water()) {
    result.open_water_elapsed_s = to_seconds(usable->at - started_at);
    result.open_water_battery = usable->battery_fraction;
  }
  if (behavior.state()) result.goals_done = behavior.behavior().goals_done();
  result.rung = ladder.rung();
  result.rung_cause = ladder.cause();
  result.paused = paused;
  result.queries = behavior.queries();
  result.imu_bias = imu_bias;
  return result;
}

}  // namespace dive::mission
