#include "mission/scenario/script.h"

#include <cmath>
#include <variant>

namespace dive::mission {
namespace {

constexpr std::uint64_t kLossStream = 77;  // of the scenario's seed

bool concerns(const LossAction& loss, SampleStream stream) {
  return loss.of == stream || loss.of == SampleStream::kAll;
}

}  // namespace

ScriptPlayer::ScriptPlayer(const Scenario& scenario, DiveRecord& record, Script script)
    : scenario_(scenario),
      record_(record),
      is_disabled_(script == Script::kDisabled),
      random_(scenario.seed, kLossStream),
      due_s_(scenario.steps.size()),
      done_(scenario.steps.size(), false) {
  for (std::size_t i = 0; i < scenario.steps.size(); ++i) {
    const Trigger& trigger = scenario.steps[i].trigger;
    if (trigger.kind == Trigger::Kind::kTime) due_s_[i] = trigger.after_s;
  }
}

void ScriptPlayer::play(const DiveHands& hands) {
  now_s_ = to_seconds(hands.inputs.now);
  arm();
  for (std::size_t i = 0; i < scenario_.steps.size(); ++i) {
    if (done_[i] || !due_s_[i] || now_s_ < *due_s_[i]) continue;
    done_[i] = true;
    const ScriptStep& step = scenario_.steps[i];
    record_.occurrences.push_back(
        {Occurrence::Kind::kStep, now_s_, step.id.value, {}, static_cast<int>(i)});
    if (is_disabled_) continue;
    for (const ScriptAction& action : step.actions) act(action, hands);
  }
  lose(hands.inputs);
  speak(hands.inputs);
}

bool ScriptPlayer::triggers(const Occurrence& occurrence, const Trigger& trigger) {
  if (occurrence.name != trigger.name.value) return false;
  switch (trigger.kind) {
    case Trigger::Kind::kTime:
      return false;
    case Trigger::Kind::kState:
      return occurrence.kind == Occurrence::Kind::kEntered;
    case Trigger::Kind::kEvent:
      return occurrence.kind == Occurrence::Kind::kEvent;
    case Trigger::Kind::kGoal:
      return occurrence.kind == Occurrence::Kind::kHeading;
  }
  return false;
}

void ScriptPlayer::arm() {
  for (; processed_ < record_.occurrences.size(); ++processed_) {
    const Occurrence& occurrence = record_.occurrences[processed_];
    for (std::size_t i = 0; i < scenario_.steps.size(); ++i) {
      const Trigger& trigger = scenario_.steps[i].trigger;
      if (due_s_[i] || !triggers(occurrence, trigger)) continue;
      due_s_[i] = occurrence.t_s + trigger.after_s;
    }
  }
}

void ScriptPlayer::act(const ScriptAction& action, const DiveHands& hands) {
  if (const auto* fail = std::get_if<FailAction>(&action)) {
    hands.faults.add({fail->kind, now_s_, fail->for_s});
  } else if (const auto* loss = std::get_if<LossAction>(&action)) {
    losses_.push_back({*loss, now_s_ + loss->for_s});
  } else if (const auto* operator_action = std::get_if<OperatorAction>(&action)) {
    to_send_.push_back(operator_action->command);
  } else if (const auto* heartbeat = std::get_if<HeartbeatAction>(&action)) {
    heartbeats_.push_back({*heartbeat, now_s_, now_s_ + heartbeat->for_s});
  } else if (const auto* current = std::get_if<CurrentAction>(&action)) {
    hands.simulator.set_current(current->current_W);
  } else if (const auto* dropped = std::get_if<ObstacleAction>(&action)) {
    hands.appearing.push_back(dropped->obstacle);
    if (!dropped->ahead_m) return;
    const Pose& X_WB = hands.simulator.truth().X_WB;
    const double yaw = to_rpy(X_WB.q).z();
    hands.appearing.back().X_WO = {
        X_WB.p + *dropped->ahead_m * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0),
        from_rpy(0.0, 0.0, yaw)};
  }
}

void ScriptPlayer::lose(StepInputs& inputs) {
  const auto is_lost = [this](const Loss& loss, SampleStream stream) {
    return now_s_ < loss.until_s && concerns(loss.action, stream) &&
           random_.uniform() < loss.action.share;
  };
  for (const Loss& loss : losses_) {
    if (inputs.imu && is_lost(loss, SampleStream::kImu)) inputs.imu.reset();
    if (inputs.depth && is_lost(loss, SampleStream::kDepth)) inputs.depth.reset();
    if (inputs.health && is_lost(loss, SampleStream::kHealth)) inputs.health.reset();
    if (inputs.plan && is_lost(loss, SampleStream::kPlan)) inputs.plan.reset();
  }
}

void ScriptPlayer::speak(StepInputs& inputs) {
  for (Heartbeat& heartbeat : heartbeats_) {
    if (now_s_ < heartbeat.next_s || now_s_ >= heartbeat.until_s) continue;
    heartbeat.next_s = now_s_ + heartbeat.action.every_s;
    to_send_.push_back(OperatorCommand::kHeartbeat);
  }
  if (to_send_.empty()) return;
  inputs.operator_command = to_send_.front();
  to_send_.pop_front();
}

}  // namespace dive::mission
