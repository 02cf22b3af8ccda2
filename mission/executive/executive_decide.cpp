// The stages of a tick that decide which state is active: collect_events, evaluate_failsafes,
// process_events.

#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "mission/executive/executive_impl.h"
#include "mission/executive/failsafe_words.h"

namespace dive::mission {
namespace {

using behaviors::Rung;
using statechart::StateId;

/// The event for the transition to the executive's own state of a rung; null if the rung has none.
const char* takeover_event(Rung rung) {
  switch (rung) {
    case Rung::kRetrace:
      return kRetraceEvent;
    case Rung::kAbortAndSurface:
      return kAbortEvent;
    case Rung::kEmergencySurface:
      return kEmergencyEvent;
    default:
      return nullptr;
  }
}

FailsafeRecord record_of(const behaviors::FailsafeLadder::Change& change, const Mission& mission,
                         const Situation& situation) {
  FailsafeRecord record{
      behaviors::to_string(change.rung),
      std::string(behaviors::to_string(change.cause)),
      {},
      change.rung == Rung::kNone ? "it is gone" : describe(change.cause, mission, situation)};
  if (change.escalated) record.why += ", and it did not pass";
  for (const behaviors::FailsafeKind kind : change.competing) {
    if (!record.competing.empty()) record.competing += ", ";
    record.competing += behaviors::to_string(kind);
  }
  return record;
}

}  // namespace

// Processing order: events of the operator, of the estimator, of the map, and then of the
// failsafes.
void Executive::Impl::collect_events(const StepInputs& inputs) {
  if (inputs.operator_command) obey(*inputs.operator_command);
  if (localization.has_switched()) {
    const std::string cause = localization.describe_switch();
    note("estimator " + cause);
    raise_event("estimator.switched", cause);
  }
  if (inputs.vision) {
    if (auto cause = localization.describe_loop(situation.now, inputs.vision->loops)) {
      note("loop closed: " + *cause);
      raise_event("loop.closed", std::move(*cause));
    }
  }
  for (std::string& change : object_changes) raise_event("map.changed", std::move(change));
  const bool was_blocked = std::exchange(path_was_blocked, situation.progress.path_is_blocked);
  if (path_was_blocked && !was_blocked) {
    raise_event("map.changed", "an observed obstacle is in the path");
  }
  const bool had_trusted = std::exchange(trail_is_trusted, situation.progress.trusts_trail);
  if (trail_is_trusted && !had_trusted) {
    note(
        "by the map the vehicle is inside an obstacle: it follows its trail, whatever the map has "
        "on it");
  }
}

void Executive::Impl::obey(OperatorCommand operator_command) {
  monitors.heartbeat(situation.now);  // every command is a heartbeat of topside
  switch (operator_command) {
    case OperatorCommand::kHeartbeat:
      return;
    case OperatorCommand::kAbort:
      return abort("topside commanded abort");
    case OperatorCommand::kSigterm:
    case OperatorCommand::kSigint:
      situation.is_terminated = true;
      return abort(fmt::format("{} to the executive", to_string(operator_command)));
    case OperatorCommand::kPause:
      if (!std::exchange(paused, true)) raise_event("operator.pause", "topside commanded pause");
      return;
    case OperatorCommand::kResume:
      if (std::exchange(paused, false)) raise_event("operator.resume", "topside commanded resume");
      return;
    case OperatorCommand::kSkip:
      skip_requested = true;
      return;
  }
}

void Executive::Impl::abort(std::string cause) {
  situation.operator_abort = cause;
  raise_event("abort", std::move(cause));
}

void Executive::Impl::evaluate_failsafes() {
  const bool was_losing = monitors.is_true(behaviors::FailsafeKind::kLogLost);
  const behaviors::FailsafeConditions& conditions = monitors.update(monitor_input(situation));
  situation.map_agreement = monitors.map_agreement();
  situation.imu_loss = monitors.imu_loss();
  situation.depth_loss = monitors.depth_loss();
  // The records of its beginning are among what was lost.
  if (was_losing && !monitors.is_true(behaviors::FailsafeKind::kLogLost)) {
    note(describe(behaviors::FailsafeKind::kLogLost, mission, situation));
  }
  const auto change = ladder.update(situation.now, conditions, situation.can_ascend);
  if (change) take_rung(*change);
}

void Executive::Impl::take_rung(const behaviors::FailsafeLadder::Change& change) {
  const FailsafeRecord record = record_of(change, mission, situation);
  outputs.failsafes.push_back(record);
  held.reset();
  if (!runner.is_running() || change.rung == Rung::kNone) return;
  const std::string cause = fmt::format("failsafe {}: {}", record.cause, record.why);
  raise_event("failsafe." + record.cause, cause);
  const char* takeover = takeover_event(change.rung);
  if (takeover == nullptr) return;
  runner.set_abort_cause(cause);
  paused = false;  // a pause never prevents surfacing
  raise_event(takeover, cause);
}

// The only place where events of a tick are dispatched to the machine, except those of the
// behaviour's end.
void Executive::Impl::process_events() {
  if (std::exchange(skip_requested, false)) skip();
  for (const Event& event : events) {
    if (runner.is_running()) runner.dispatch(event);
  }
  if (const std::optional<Event> timeout = runner.next_timeout()) {
    if (runner.abort_cause().empty()) runner.set_abort_cause(timeout->cause);
    // others are reported in the next tick, because the states have changed
    runner.dispatch(*timeout);
  }
  if (runner.is_running()) runner.settle();
}

// The mission may handle a skip itself; otherwise the goal is skipped, or the state if it has no
// goals.
void Executive::Impl::skip() {
  const char* cause = "topside commanded skip";
  if (!behavior.is_missions()) {
    return note("skip ignored: the mission does not command the vehicle");
  }
  const StateId state = *behavior.state();
  const std::string& id = machine.chart.states[static_cast<std::size_t>(state)].id;
  if (runner.is_running()) runner.dispatch({"operator.skip", cause});
  if (behavior.state() != state || behavior.behavior().skip()) return;
  runner.dispatch({"done.state." + id, cause});
}

}  // namespace dive::mission
