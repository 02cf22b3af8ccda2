#include "mission/check/route.h"

#include <algorithm>
#include <utility>

#include "common/assert.h"
#include "mission/document/state_index.h"
#include "mission/executive/behavior_factory.h"
#include "mission/executive/machine.h"
#include "mission/statechart/interpreter.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {
namespace {

class Walker final : public statechart::Environment {
 public:
  Walker(const Mission& mission, const planning::Scene& scene)
      : machine_(build_machine(mission)), context_(make_behavior_context(mission, scene, 1)) {
    route_.start.p = mission.start.in_world(ground_height(scene, mission.start));
    route_.start.q = from_rpy(0.0, 0.0, heading_to_yaw(mission.start_heading_deg));
    route_.settings = context_.leg;
    at_ = route_.start.p;
  }

  Route walk() {
    statechart::Interpreter interpreter(machine_.chart, *this);
    interpreter_ = &interpreter;
    interpreter.start();
    while (interpreter.running() && !open_states_.empty() &&
           route_.atomic_states.size() < kMaxAtomicStates) {
      const statechart::StateId state = open_states_.back();
      open_states_.pop_back();
      if (!interpreter.is_active(state)) continue;
      interpreter.dispatch("done.state." + machine_.chart.states[index(state)].id);
    }
    if (interpreter.running()) route_.final_state.clear();
    return std::move(route_);
  }

  bool evaluate(statechart::GuardId guard) override {
    return machine_.guards[index(guard)].evaluate(GuardVariables{});
  }
  // Only the events raised by actions affect the route.
  void execute(statechart::ActionId id) override {
    const ActionSpec& action = machine_.actions[index(id)];
    if (action.kind == ActionSpec::Kind::kRaise) interpreter_->raise(action.text.value);
  }
  void exited(statechart::StateId) override {}
  void taken(int, const std::string&) override {}

  void entered(statechart::StateId state) override {
    const statechart::State& entered_state = machine_.chart.states[index(state)];
    if (entered_state.kind == statechart::StateKind::kFinal && entered_state.parent == 0) {
      route_.final_state = entered_state.id;
    }
    if (entered_state.kind != statechart::StateKind::kAtomic) return;
    const StateSpec* spec = machine_.specs[index(state)];
    if (spec == nullptr || !spec->atomic) return;
    open_states_.push_back(state);
    route_.atomic_states.push_back(entered_state.id);
    add_state(*spec);
  }

 private:
  static std::size_t index(int id) { return static_cast<std::size_t>(id); }

  void add_state(const StateSpec& spec) {
    for (const Goal* goal : goals_of(spec)) add_goal(spec, *goal);
    route_.after.rest_s += spec.atomic->rest_s().value;
    if (is_surfacing(spec)) {
      route_.after.ascent_m += std::max(-at_.z(), 0.0);
      route_.ascent_m += std::max(-at_.z(), 0.0);
      at_.z() = 0.0;
    }
  }

  void add_goal(const StateSpec& spec, const Goal& goal) {
    RouteLeg leg{spec.id.value, goal.span, at_, leg_goal(*context_.scene, goal), {}};
    leg.dwell_yaw = leg.goal.yaw;
    if (goal.dwell_heading_deg) leg.dwell_yaw = heading_to_yaw(*goal.dwell_heading_deg);
    const auto& limits = context_.mission->limits;
    const auto& reduced =
        goal.reduced_clearance ? goal.reduced_clearance : limits.reduced_clearance;
    if (reduced) leg.reduced_clearance = reduced->value;
    at_ = leg.goal.position_W;
    leg.before = std::exchange(route_.after, {});
    route_.legs.push_back(std::move(leg));
  }

  Machine machine_;
  statechart::Interpreter* interpreter_ = nullptr;
  BehaviorContext context_;
  Route route_;
  Eigen::Vector3d at_;
  std::vector<statechart::StateId> open_states_;
};

}  // namespace

Route nominal_route(const Mission& mission, const planning::Scene& scene) {
  return Walker(mission, scene).walk();
}

}  // namespace dive::mission
