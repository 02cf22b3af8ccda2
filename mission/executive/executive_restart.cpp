#include <fmt/format.h>

#include "mission/executive/executive_impl.h"
#include "mission/executive/leaf_behaviors.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {

using behaviors::Rung;

Eigen::Vector3d Executive::Impl::first_position() const {
  if (options.resume) return options.resume->committed.X_WB.p;
  return mission.start.in_world(ground_height(map.scene(), mission.start));
}

double Executive::Impl::first_sigma() const {
  return options.resume ? options.resume->committed.sigma_m : options.start_sigma_m;
}

void Executive::Impl::resume(const Resume& from) {
  const Committed& committed = from.committed;
  const double gap_s = gap_of(from, situation.now, mission.max_gap_s.value);
  if (!from.gap_s) {
    const Drift drift = drift_in(gap_s, committed);
    localization.went_on(drift.by_W, drift.sigma_m, drift.surge);
    helm.begin_at(drift.surge);
  }
  outputs.estimate = situation.estimate = localization.update(situation.now);
  started_at = situation.now - from_seconds(committed.elapsed_s + gap_s);
  surroundings.restore(from.trail);
  assess();
  if (committed.under_elapsed_s && !situation.open_above) {
    surroundings.restore(
        Usable{started_at + from_seconds(*committed.under_elapsed_s), committed.under_battery});
  }
  ladder.restore(committed.rung, committed.rung_cause);
  paused = committed.paused;
  behavior.restore(committed.queries);
  goals_left_out = committed.goals_done;
  runner.restore(committed);
  goals_left_out = 0;
  outputs.transitions.push_back({"", runner.innermost(), "", "the executive was restarted", ""});
  if (committed.rung < Rung::kRetrace) resume_by_policy(gap_s);
}

void Executive::Impl::resume_by_policy(double gap_s) {
  if (mission.resume == ResumePolicy::kSurface) {
    runner.set_abort_cause("restarted, and the mission says surface");
  } else if (gap_s > mission.max_gap_s.value) {
    runner.set_abort_cause(
        fmt::format("restarted after {:.0f} s, more than {:g} s", gap_s, mission.max_gap_s.value));
  } else {
    paused = paused || mission.resume == ResumePolicy::kHold;
    return;
  }
  runner.dispatch({kAbortEvent, runner.abort_cause()});
}

Committed Executive::Impl::committed() const {
  Committed result;
  result.utime = situation.now;
  result.elapsed_s = to_seconds(situation.now - started_at);
  runner.save(result);
  const estimation::StateEstimate& estimate = situation.estimate;
  result.X_WB = estimate.X_WB;
  result.v_W = estimate.X_WB.q * estimate.v_WB_B;
  result.sigma_m = estimation::horizontal_sigma(estimate);
  if (const std::optional<Usable>& usable = surroundings.last_in_open_water()) {
    result.under_elapsed_s = to_seconds(usable->at - started_at);
    result.under_battery = usable->battery_fraction;
  }
  if (behavior.state()) result.goals_done = behavior.behavior().goals_done();
  result.rung = ladder.rung();
  result.rung_cause = ladder.cause();
  result.paused = paused;
  result.queries = behavior.queries();
  return result;
}

}  // namespace dive::mission
