#include "mission/scenario/dive_record.h"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "mission/scenario/script.h"
#include "mission/simulation/simulated_conditions.h"
#include "vehicle/simulator/water/named_waters.h"

namespace dive::mission {

using Kind = Occurrence::Kind;

DiveWatch::DiveWatch(const Scenario& scenario, DiveRecord& record)
    : scenario_(scenario), record_(record) {
  record_.nearest_m.assign(scenario.expectations.size(), std::numeric_limits<double>::infinity());
}

void DiveWatch::keep(const Executive& executive, const StepOutputs& outputs) {
  if (outputs.transitions.empty()) return;
  active_before_ = std::move(active_);
  Checkpoint now = executive.checkpoint();
  new_.clear();
  for (std::size_t i = 0; i < now.active.size(); ++i) {
    if (now.active_s[i] <= 0.0) new_.insert(now.active[i]);
  }
  active_ = std::move(now.active);
}

void DiveWatch::observe(const StepInputs& inputs, const StepOutputs& outputs,
                        const vehicle::GroundTruth& truth) {
  now_s_ = to_seconds(inputs.now);
  note_states(outputs);
  note_events(outputs);
  note_actions(outputs);
  note_places(truth);
  if (outputs.plan_query && !outputs.plan_query->request.previous.empty()) {
    std::string cause = outputs.plan_query->cause;
    std::ranges::replace(cause, ' ', '_');
    add(Kind::kReplan, std::move(cause));
  }
  if (outputs.status.goal != goal_) {
    goal_ = outputs.status.goal;
    if (!goal_.empty()) add(Kind::kHeading, goal_);
  }
}

void DiveWatch::add(Kind kind, std::string name, std::string cause) {
  record_.occurrences.push_back({kind, now_s_, std::move(name), std::move(cause)});
}

// Records innermost states named by transitions, even those exited within the tick, and all other
// states that have become active. A transition from a state to itself is one without a target,
// unless the state is new.
void DiveWatch::note_states(const StepOutputs& outputs) {
  if (outputs.transitions.empty()) return;
  std::set<std::string> named;
  for (const TransitionRecord& transition : outputs.transitions) {
    if (transition.to == transition.from && !new_.contains(transition.to)) continue;
    named.insert(transition.to);
    add(Kind::kEntered, transition.to);
  }
  for (const std::string& state : active_) {
    const bool was = std::ranges::find(active_before_, state) != active_before_.end();
    if (!was && !named.contains(state)) add(Kind::kEntered, state);
  }
}

void DiveWatch::note_events(const StepOutputs& outputs) {
  std::set<std::string> taken;
  for (const TransitionRecord& transition : outputs.transitions) {
    if (transition.event.empty()) continue;
    taken.insert(transition.event);
    add(Kind::kEvent, transition.event);
  }
  for (const FailsafeRecord& failsafe : outputs.failsafes) {
    add(Kind::kRung, failsafe.rung, failsafe.cause);
    const std::string event = "failsafe." + failsafe.cause;
    if (failsafe.rung != "none" && !taken.contains(event)) add(Kind::kEvent, event);
  }
}

void DiveWatch::note_actions(const StepOutputs& outputs) {
  for (const ActionRecord& action : outputs.actions) {
    add(action.kind == ActionRecord::Kind::kPayload ? Kind::kPayload : Kind::kLine, action.text);
  }
}

void DiveWatch::note_places(const vehicle::GroundTruth& truth) {
  record_.max_depth_m = std::max(record_.max_depth_m, -truth.X_WB.p.z());
  record_.end_W = truth.X_WB.p;
  for (std::size_t i = 0; i < scenario_.expectations.size(); ++i) {
    if (scenario_.expectations[i].kind != Expectation::Kind::kReaches) continue;
    const double away_m = (truth.X_WB.p - scenario_.expectations[i].place_W).norm();
    record_.nearest_m[i] = std::min(record_.nearest_m[i], away_m);
  }
}

DiveRecord dive_scenario(const Scenario& scenario, const Mission& mission,
                         const planning::World& world,
                         const std::optional<planning::World>& simulated,
                         const vehicle::Model& model, Script script, const DiveObserver& observer) {
  DiveRecord record;
  DiveWatch watch(scenario, record);
  ScriptPlayer player(scenario, record, script);
  DiveSettings settings;
  settings.seed = scenario.seed;
  settings.conditions = simulated_conditions(mission);
  for (const auto& [name, value] : scenario.conditions) {
    DIVE_DEMAND(settings.conditions.set(name, value));
  }
  settings.rest_s = scenario.rest_s;
  if (script == Script::kPlayed) settings.diver = scenario.diver;
  settings.world = simulated;
  settings.cameras =
      vehicle::stereo_camera_in(mission.simulated_water)->scaled(scenario.camera_scale);
  settings.cameras->rate_hz = scenario.camera_hz;
  settings.script = [&](const DiveHands& hands) { player.play(hands); };
  record.result = simulate_dive(
      mission, world, model, settings,
      [&](const StepInputs& inputs, const StepOutputs& outputs, const vehicle::GroundTruth& truth,
          const TickContacts& contacts) {
        watch.observe(inputs, outputs, truth);
        if (observer) observer(inputs, outputs, truth, contacts);
      },
      [&](const Executive& executive, const StepOutputs& outputs) {
        watch.keep(executive, outputs);
      });
  return record;
}

}  // namespace dive::mission
