#include "mission/executive/active_behavior.h"

#include "common/assert.h"
#include "mission/document/state_index.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {

using statechart::StateId;

ActiveBehavior::ActiveBehavior(const Mission& mission, const Machine& machine, MapView& map,
                               const behaviors::Trail& trail, std::uint64_t seed)
    : machine_(machine),
      map_(map),
      trail_(trail),
      context_(make_behavior_context(mission, map.scene(), seed)),
      is_in_unknown_(mission.unknown.has_value()),
      view_(stopping_speed_options(mission)),
      behaviors_(machine.chart.states.size()) {
  for (const StateSpec* spec : machine.specs) {
    declared_overheads_.push_back(
        spec != nullptr && is_planning(*spec) ? std::optional(spec->overhead) : std::nullopt);
  }
}

void ActiveBehavior::enter(StateId state, int goals_done) {
  const auto index = static_cast<std::size_t>(state);
  if (!machine_.atomic[index]) return;
  progress_ = {};
  behaviors_[index] = make(state, goals_done);
}

std::unique_ptr<behaviors::Behavior> ActiveBehavior::make(StateId state, int goals_done) const {
  const auto index = static_cast<std::size_t>(state);
  const StateSpec* spec = machine_.specs[index];
  return machine_.atomic[index]->make_behavior(
      {.leg = spec != nullptr ? leg_settings(context_, *spec) : context_.leg,
       .scene = *context_.scene,
       .trail = trail_,
       .observed_map = map_,
       .goals_done = goals_done});
}

void ActiveBehavior::leave(StateId state) {
  behaviors_[static_cast<std::size_t>(state)].reset();
  view_.stop_waiting();
}

std::optional<StateId> ActiveBehavior::state() const {
  for (std::size_t i = behaviors_.size(); i-- > 0;) {
    if (behaviors_[i]) return static_cast<StateId>(i);
  }
  return std::nullopt;
}

bool ActiveBehavior::is_missions() const {
  const std::optional<StateId> active = state();
  return active && !machine_.is_own(*active);
}

std::optional<bool> ActiveBehavior::declared_overhead() const {
  const std::optional<StateId> active = state();
  return active ? declared_overheads_[static_cast<std::size_t>(*active)] : std::nullopt;
}

behaviors::Behavior& ActiveBehavior::behavior() const {
  const std::optional<StateId> active = state();
  DIVE_DEMAND(active);
  return *behaviors_[static_cast<std::size_t>(*active)];
}

behaviors::BehaviorOutput ActiveBehavior::step(const Situation& situation, bool replan,
                                               std::optional<PlanQuery>& query) {
  behaviors::Behavior& active = behavior();
  const StateId active_state = *state();
  behaviors::BehaviorInput input = behavior_input(situation);
  const std::optional<PlanReply> reply = std::exchange(reply_, std::nullopt);
  const bool is_answered = reply && reply->id == asked_id_ && asked_by_ == active_state;
  input.plan = is_answered ? &reply->plan : nullptr;
  input.replan = replan;
  input.map_changed = std::exchange(map_changed_, false);
  input.trail = &trail_;
  input.observed = map_.has_observed() ? &map_ : nullptr;
  behaviors::BehaviorOutput output = active.step(input);
  progress_ = active.progress();
  if (output.plan_request) {
    asked_id_ = ++queries_;
    asked_by_ = active_state;
    query = PlanQuery{asked_id_, machine_.chart.states[static_cast<std::size_t>(active_state)].id,
                      output.plan_cause, std::move(*output.plan_request)};
  }
  if (is_in_unknown_ && active.needs_free_ahead()) limit_by_view(situation, output);
  return output;
}

void ActiveBehavior::limit_by_view(const Situation& situation, behaviors::BehaviorOutput& output) {
  view_.apply(situation.now, situation.mission_now, situation.estimate, output.command);
  if (output.done || output.failed != behaviors::Failure::kNone) return;
  if (!view_.view_timed_out(situation.mission_now) || behavior().request_alternative()) return;
  progress_.plan_failure = "the planned path enters space that the sensor cannot observe";
  output.failed = behaviors::Failure::kUnreachable;
}

}  // namespace dive::mission
