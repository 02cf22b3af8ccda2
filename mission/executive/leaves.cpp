#include "mission/executive/leaves.h"

#include <variant>

#include "behaviors/hold.h"
#include "behaviors/retrace.h"
#include "behaviors/surface.h"
#include "common/assert.h"

namespace dive::mission {
namespace {

using statechart::StateId;

constexpr double kRetreatWait = 60.0;  // s in open water before a retreat ends in surfacing

}  // namespace

Leaves::Leaves(const Mission& mission, const Machine& machine, ChangedMap& map,
               const behaviors::Trail& trail, std::uint64_t seed)
    : machine_(machine),
      map_(map),
      trail_(trail),
      context_(make_leaf_context(mission, map.scene(), seed)),
      behaviors_(machine.chart.states.size()) {}

void Leaves::enter(StateId state, int goals_done) {
  const auto index = static_cast<std::size_t>(state);
  const StateSpec* spec = machine_.specs[index];
  if (spec != nullptr && std::holds_alternative<std::monostate>(spec->leaf)) return;
  progress_ = {};
  behaviors_[index] = make(state, goals_done);
}

std::unique_ptr<behaviors::Behavior> Leaves::make(StateId state, int goals_done) const {
  const auto index = static_cast<std::size_t>(state);
  const StateSpec* spec = machine_.specs[index];
  const std::string& id = machine_.chart.states[index].id;
  const bool is_retrace = spec != nullptr ? std::holds_alternative<RetraceState>(spec->leaf)
                                          : id == kRetraceState || id == kBackState;
  if (is_retrace) return std::make_unique<behaviors::Retrace>(trail_, context_.leg, &map_);
  if (spec != nullptr) return make_leaf_behavior(context_, *spec, goals_done);
  if (id == kWaitState) return std::make_unique<behaviors::Hold>(kRetreatWait);
  if (id == kEmergencyState) return std::make_unique<behaviors::Surface>();
  return make_surface(context_);
}

void Leaves::leave(StateId state) { behaviors_[static_cast<std::size_t>(state)].reset(); }

std::optional<StateId> Leaves::active() const {
  for (std::size_t i = behaviors_.size(); i-- > 0;) {
    if (behaviors_[i]) return static_cast<StateId>(i);
  }
  return std::nullopt;
}

const StateSpec* Leaves::active_spec() const {
  const std::optional<StateId> leaf = active();
  return leaf ? machine_.specs[static_cast<std::size_t>(*leaf)] : nullptr;
}

behaviors::Behavior& Leaves::behavior() const {
  const std::optional<StateId> leaf = active();
  DIVE_DEMAND(leaf);
  return *behaviors_[static_cast<std::size_t>(*leaf)];
}

behaviors::BehaviorOutput Leaves::step(behaviors::BehaviorInput input,
                                       std::optional<PlanQuery>& query) {
  behaviors::Behavior& active_behavior = behavior();
  const StateId leaf = *active();
  behaviors::PlanAnswer answer;
  const std::optional<PlanReply> reply = std::exchange(reply_, std::nullopt);
  const bool is_answered = reply && reply->id == asked_id_ && asked_by_ == leaf;
  if (is_answered) answer = {reply->status, reply->reason, reply->waypoints, reply->clearance_m};
  input.plan = is_answered ? &answer : nullptr;
  input.map_changed = std::exchange(map_changed_, false);
  input.trail = &trail_;
  input.seen = map_.has_changed() ? &map_ : nullptr;
  behaviors::BehaviorOutput result = active_behavior.step(input);
  progress_ = active_behavior.progress();
  if (result.plan_request) {
    asked_id_ = ++queries_;
    asked_by_ = leaf;
    query = PlanQuery{asked_id_, machine_.chart.states[static_cast<std::size_t>(leaf)].id,
                      result.plan_cause, std::move(*result.plan_request)};
  }
  return result;
}

}  // namespace dive::mission
