#include "mission/link/supervision.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "vehicle/command_timing.h"
#include "vehicle/link/arbiter.h"

namespace dive::mission {
namespace {

using vehicle::ExitPhase;
using Decision = link::CommandGate::Decision;

constexpr double kFinished = 0.5;  // s without a new command after the report of the end

}  // namespace

Supervision::Supervision(const SupervisorSettings& settings, std::uint64_t session_id,
                         const SupervisorLog& log)
    : settings_(settings),
      session_id_(session_id),
      log_(log),
      executive_(to_seconds(vehicle::kSessionTimeout)),
      guidance_(settings.motion, settings.map ? std::optional(settings.map->fixes) : std::nullopt),
      autopilot_(vehicle::autopilot_options(settings.motion)) {}

void Supervision::receive(const link::VehicleCommand& command, Utime now) {
  if (command.source != link::Source::kExecutive) return;
  const double silent_s = executive_.age_s(now);
  const Decision decision = executive_.receive(command, now);
  if (decision == Decision::kOtherSession && !report_.second_executive) {
    report_.second_executive = true;
    log_(fmt::format("a second executive sends commands (session {:x}): obeying the first ({:x})",
                     command.session_id, executive_.newest()->session_id));
  }
  if (decision != Decision::kAccepted) return;
  if (!continuous_since_ || silent_s > to_seconds(vehicle::kCommandStale)) continuous_since_ = now;
  commanded_at_ = now;
  efforts_ = efforts(now);
}

// An executive that has finished sends no new command.
void Supervision::receive(const link::Heartbeat& heartbeat, Utime now) {
  if (!executive_.is_from(heartbeat.session_id)) return;
  if (!heartbeat.finished) finished_at_.reset();
  if (heartbeat.finished && !finished_at_) finished_at_ = now;
}

void Supervision::receive(const link::ExitPathMessage& message) {
  if (!executive_.is_from(message.session_id)) return;
  guidance_.set_exit_path(message.path);
  const bool is_new = std::exchange(map_digest_, message.map_digest) != message.map_digest;
  if (is_new && settings_.map && settings_.map->digest != message.map_digest) {
    log_("the executive has another map: the exit path is followed without map fixes");
  }
}

void Supervision::receive(const MapFix& fix) {
  if (wants_fixes() && guidance_.propose(fix)) ++report_.fixes;
}

bool Supervision::wants_fixes() const {
  const ExitPhase phase = guidance_.phase();
  return settings_.map && settings_.map->digest == map_digest_ &&
         (phase == ExitPhase::kHolding || phase == ExitPhase::kFollowing);
}

void Supervision::receive(const ImuSample& sample, Utime now) {
  vehicle_time_ = sample.utime;
  vehicle_time_at_ = now;
  observe(sample, std::nullopt, now);
}

void Supervision::receive(const DepthSample& sample, Utime now) {
  observe(std::nullopt, sample, now);
}

void Supervision::observe(const std::optional<ImuSample>& imu,
                          const std::optional<DepthSample>& depth, Utime now) {
  guidance_.observe(imu, depth, efforts_, now);
  autopilot_.observe(imu, depth);
  efforts_ = efforts(now);
}

// As the vehicle decides, with its autopilot, on what arrives here too.
vehicle::PseudoRates Supervision::efforts(Utime now) {
  const double surge = guidance_.surge();
  if (own_) return link::execute(*own_, 0.0, surge, now, autopilot_);
  if (!executive_.newest()) return {};
  return link::execute(*executive_.newest(), executive_.age_s(now), surge, now, autopilot_);
}

std::optional<link::VehicleCommand> Supervision::step(Utime now) {
  if (!executive_.newest()) return std::nullopt;
  observe(std::nullopt, std::nullopt, now);
  const ExitPhase before = guidance_.phase();
  if (before == ExitPhase::kIdle) watch(now);
  if (before == ExitPhase::kHolding && has_recovered(now)) give_back();
  if (guidance_.phase() == ExitPhase::kIdle) return std::nullopt;
  own_ = command(now);
  note_phase(before, now);
  return own_;
}

void Supervision::watch(Utime now) {
  if (finished_at_ || executive_.age_s(now) <= settings_.command_timeout_s) return;
  ++report_.holds;
  report_.silent_s = executive_.age_s(now);
  held_session_ = executive_.newest()->session_id;
  continuous_since_.reset();
  guidance_.begin(now);
}

bool Supervision::has_recovered(Utime now) const {
  return finished_at_ ||
         (continuous_since_ && executive_.age_s(now) <= to_seconds(vehicle::kCommandStale) &&
          now - *continuous_since_ >= vehicle::kRecovered);
}

void Supervision::give_back() {
  guidance_.end();
  own_.reset();
  ++report_.given_back;
  log_(executive_.is_from(*held_session_)
           ? "the executive sends commands again: the vehicle is given back"
           : "the executive was restarted: the vehicle is given back");
}

void Supervision::note_phase(ExitPhase before, Utime now) {
  const ExitPhase phase = guidance_.phase();
  if (phase == ExitPhase::kFollowing) report_.took_over = report_.followed = true;
  if (phase == ExitPhase::kAscending) {
    report_.took_over = true;
    report_.blindly = guidance_.ascended_blindly();
    report_.surfaced = guidance_.has_surfaced(now);
    report_.presumed = !report_.surfaced && guidance_.is_presumed_surfaced(now);
    if (report_.surfaced) log_("the vehicle is at the surface");
    if (report_.presumed) log_("presumed at the surface: the depth sensor is silent");
  }
  if (phase == before) return;
  if (phase == ExitPhase::kHolding) {
    log_(fmt::format("no command of the executive for {:.1f} s: holding", report_.silent_s));
  } else if (phase == ExitPhase::kFollowing) {
    log_("the executive did not come back: following the exit path");
  } else {
    log_(guidance_.ascended_blindly() ? "no exit path is left: ascending vertically"
                                      : "open water is above: ascending");
  }
}

// Stamped with the vehicle's time, as far as it is known.
link::VehicleCommand Supervision::command(Utime now) {
  link::VehicleCommand result;
  result.command = guidance_.step(now);
  result.utime = vehicle_time_ + (now - vehicle_time_at_);
  result.sequence = ++sequence_;
  result.source = link::Source::kSupervisor;
  result.mode = link::Mode::kDepthAndAngles;
  result.session_id = session_id_;
  result.phase = guidance_.phase();
  return result;
}

bool Supervision::is_over(Utime now) const {
  if (report_.surfaced || report_.presumed) return true;
  return finished_at_ && guidance_.phase() == ExitPhase::kIdle &&
         to_seconds(now - std::max(*finished_at_, commanded_at_)) > kFinished;
}

SupervisorReport Supervision::report() const {
  SupervisorReport report = report_;
  report.restarts = std::max(executive_.sessions() - 1, 0);
  report.refused = executive_.refused();
  return report;
}

}  // namespace dive::mission
