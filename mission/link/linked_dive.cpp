#include "mission/link/linked_dive.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "mission/executive/behavior_factory.h"
#include "mission/link/inbox.h"
#include "mission/link/payload_gate.h"
#include "mission/onboard/exit_path_service.h"
#include "mission/record/log_codec.h"
#include "planning/world/world_digest.h"
#include "vehicle/command_timing.h"

namespace dive::mission {
namespace {

constexpr Utime kHeartbeatPeriod = 100'000;
constexpr const char* kOtherExecutive = "another executive commands this vehicle";
constexpr const char* kSupervisor = "the supervisor brings the vehicle home";
constexpr Utime kOtherExecutiveWait = 200'000;  // us
constexpr int kFinalRepeats = 20;
constexpr Utime kFinalPeriod = 10'000;  // us

/// Size of the largest image that the mission's cameras may send: grey, one byte per pixel.
std::optional<std::size_t> image_bytes(const Mission& mission, const LinkSettings& settings) {
  if (!uses_visual_inertial(mission)) return std::nullopt;
  std::size_t largest = 0;
  for (const CameraModel& camera : settings.vision->filter.cameras) {
    largest = std::max(
        largest, static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  }
  return largest;
}

/// A vehicle over LCM.
class LinkedVehiclePort final : public VehiclePort {
 public:
  LinkedVehiclePort(const Mission& mission, const planning::World& world,
                    const vehicle::Model& model, const LinkSettings& settings, link::Bus& bus,
                    Clock& clock, const LinkObserver& observer)
      : settings_(settings),
        bus_(bus),
        clock_(clock),
        observer_(observer),
        inbox_(bus, clock, settings.lockstep, uses_range_camera(mission),
               image_bytes(mission, settings)),
        authenticator_({bus.has_key(), mission.abort_authority == AbortAuthority::kKey}),
        exit_path_service_(known_world(mission, world), model.hull) {
    exit_path_.session_id = authenticator_.session_id();
    if (uses_map_fixes(mission)) exit_path_.map_digest = planning::world_digest(world);
    bus_.listen<link::VehicleCommand>(
        link::channel::kCommand,
        [this](const link::VehicleCommand& command) { receive_other(command); });
    if (settings.lockstep) return;
    const double ticks = longest_dive_s(mission) / to_seconds(kControlPeriod);
    result_.stats.lateness_ms.reserve(static_cast<std::size_t>(ticks) + 1);
  }

  /// False if it sent nothing for as long as the settings allow.
  [[nodiscard]] bool wait_for_vehicle() {
    const Utime deadline = clock_.now() + from_seconds(settings_.timeout_s);
    bus_.wait(clock_, deadline, [this] { return inbox_.first_time().has_value(); });
    return inbox_.first_time().has_value();
  }

  // Processes first what arrived during the construction of the executive, and waits for commands
  // of another one, which come fifty times a second.
  [[nodiscard]] Utime begin() override {
    const Utime built = clock_.now();
    const Utime until = settings_.lockstep ? built : built + kOtherExecutiveWait;
    bus_.wait(clock_, until, [this] { return other_executive_; });
    if (other_executive_) yield(kOtherExecutive);
    local_ = clock_.now();
    now_ = began_ = *inbox_.first_time() + (settings_.lockstep ? 0 : local_ - built);
    inbox_.set_time(now_, local_);
    last_ = now_ - 1;
    return began_;
  }

  [[nodiscard]] std::optional<Utime> wait_for_tick() override {
    other_executive_ = false;
    if (settings_.lockstep) {
      if (!wait_in_lockstep()) return std::nullopt;
    } else {
      wait_in_real_time();
    }
    if (!yields_to_.empty()) return std::nullopt;
    last_ = now_;
    return now_;
  }

  void sense(StepInputs& inputs) override {
    inbox_.take(inputs);
    receive_topside(inputs);
    report_loss(inputs);
  }

  void command(const StepOutputs& outputs) override {
    command_ = link::VehicleCommand{now_,
                                    ++sequence_,
                                    link::Source::kExecutive,
                                    link::Mode::kRates,
                                    outputs.command,
                                    outputs.rates,
                                    authenticator_.session_id()};
    publish(link::channel::kCommand, *command_);
    send_payload(outputs);
    if (abort_arrived_) {
      result_.stats.abort_ms.push_back(
          static_cast<float>(static_cast<double>(clock_.now() - *abort_arrived_) / 1000.0));
    }
  }

  void keep_exit_path(const vehicle::ExitPath& path,
                      const planning::ObservedMap& observed) override {
    const double clearance_m = exit_path_service_.clearance(path, observed);
    const vehicle::ExitPath& sent = exit_path_.path;
    const bool is_new = path.revision != sent.revision || path.open_above != sent.open_above ||
                        path.hold_s != sent.hold_s || clearance_m != sent.clearance_m;
    if (!is_new && now_ < next_exit_path_) return;
    next_exit_path_ = now_ + kHeartbeatPeriod;
    exit_path_.path = path;
    exit_path_.path.clearance_m = clearance_m;
    publish(link::channel::kExitPath, exit_path_);
  }

  [[nodiscard]] std::optional<RangeScan> take_scan() override { return inbox_.take_scan(); }
  [[nodiscard]] std::vector<ImuSample> take_imu_samples() override {
    return inbox_.take_imu_samples();
  }
  [[nodiscard]] StereoPair take_images() override { return inbox_.take_images(now_); }

  void end_tick(const StepInputs& inputs, const StepOutputs& outputs) override {
    result_.distance_m += outputs.estimate.v_WB_B.norm() * to_seconds(kControlPeriod);
    if (outputs.estimate.valid) {
      result_.final_sigma_m = estimation::horizontal_sigma(outputs.estimate);
    }
    is_finished_ = outputs.status.finished;
    ++result_.stats.ticks;
    publish_outputs(inputs, outputs);
    if (observer_) observer_(inputs, outputs, inbox_.take_truth());
  }

  [[nodiscard]] LinkedResult finish(OnboardReport report);

 private:
  [[nodiscard]] bool wait_in_lockstep();
  void wait_in_real_time();
  void receive_topside(StepInputs& inputs);
  void receive_other(const link::VehicleCommand& command);
  void yield(const char* to) {
    if (yields_to_.empty()) yields_to_ = to;
  }
  void report_loss(StepInputs& inputs);
  void send_payload(const StepOutputs& outputs);
  void publish_outputs(const StepInputs& inputs, const StepOutputs& outputs);
  void publish_final();
  [[nodiscard]] link::Heartbeat heartbeat();

  template <typename Value>
  void publish(const char* channel, const Value& value) {
    if (link::encode(value, packet_)) bus_.publish(channel, packet_);
  }

  const LinkSettings& settings_;
  link::Bus& bus_;
  Clock& clock_;
  const LinkObserver& observer_;
  Inbox inbox_;
  link::RequestAuthenticator authenticator_;
  PayloadGate gate_;
  RecordingLoss loss_;                           ///< Last reported.
  std::optional<link::VehicleCommand> command_;  ///< Last command.
  std::int64_t sequence_ = 0;
  std::optional<Utime> abort_arrived_;  ///< Arrival time of the abort executed in this tick.
  Utime began_ = 0;                     ///< Start of the dive by the vehicle's clock.
  Utime local_ = 0;                     ///< Start of the dive by our clock.
  Utime now_ = 0;
  Utime last_ = 0;  ///< Previous tick, until the next one arrives.
  Utime next_heartbeat_ = 0;
  bool is_finished_ = false;
  ExitPathService exit_path_service_;
  link::ExitPathMessage exit_path_;  ///< Last one sent.
  Utime next_exit_path_ = 0;
  bool other_executive_ = false;  ///< Commands of another one arrived in this tick.
  std::string yields_to_;         ///< What commands the vehicle instead; empty: none.
  link::Packet packet_;
  LinkedResult result_;
};

bool LinkedVehiclePort::wait_in_lockstep() {
  const Utime deadline = clock_.now() + from_seconds(settings_.timeout_s);
  while (!inbox_.is_whole(last_)) {
    if (clock_.now() >= deadline) return false;
    bus_.wait(clock_, deadline, [this] {
      // Our command was lost.
      const bool again = inbox_.is_asked_again() && inbox_.tick() == last_;
      if (again && command_) publish(link::channel::kCommand, *command_);
      return inbox_.is_whole(last_);
    });
  }
  now_ = inbox_.tick();
  return true;
}

void LinkedVehiclePort::wait_in_real_time() {
  if (result_.stats.ticks > 0) now_ += kControlPeriod;
  const Utime due = local_ + (now_ - began_);
  bus_.wait(clock_, due);
  const Utime late = clock_.now() - due;
  result_.stats.lateness_ms.push_back(static_cast<float>(static_cast<double>(late) / 1000.0));
  // Another one was started while this one was stopped.
  if (late > vehicle::kSessionTimeout && other_executive_) yield(kOtherExecutive);
  if (late > kControlPeriod) {
    result_.stats.skipped += late / kControlPeriod;
    now_ += late / kControlPeriod * kControlPeriod;
  }
}

// At most one request is executed in a tick.
void LinkedVehiclePort::receive_topside(StepInputs& inputs) {
  abort_arrived_.reset();
  while (!inputs.operator_command) {
    const std::optional<Inbox::Request> received = inbox_.take_request();
    if (!received) return;
    const link::RequestAuthenticator::Decision decision =
        authenticator_.evaluate(received->request, received->trust, clock_.now());
    if (decision.answer) publish(link::channel::kAnswer, *decision.answer);
    if (!decision.act) continue;
    inputs.operator_command = received->request.command;
    if (received->request.command == OperatorCommand::kAbort) abort_arrived_ = received->arrived;
  }
}

// A supervisor that has left the place where it held keeps the vehicle: our position is wrong.
void LinkedVehiclePort::receive_other(const link::VehicleCommand& command) {
  if (command.source == link::Source::kSupervisor) {
    if (command.phase >= vehicle::ExitPhase::kFollowing) yield(kSupervisor);
  } else if (command.session_id != authenticator_.session_id()) {
    other_executive_ = true;
  }
}

void LinkedVehiclePort::report_loss(StepInputs& inputs) {
  if (!settings_.recording_loss) return;
  RecordingLoss loss = settings_.recording_loss();
  loss.commands = gate_.withheld();
  if (loss == loss_) return;
  inputs.loss = loss_ = loss;
}

void LinkedVehiclePort::send_payload(const StepOutputs& outputs) {
  const bool is_on_disk = !settings_.has_journaled_commands || settings_.has_journaled_commands();
  gate_.pass(now_, outputs.actions, is_on_disk, [this](const ActionRecord& command) {
    if (encode(now_, command, packet_)) bus_.publish(link::channel::kPayload, packet_);
  });
}

link::Heartbeat LinkedVehiclePort::heartbeat() {
  link::Heartbeat heartbeat;
  heartbeat.utime = now_;
  heartbeat.session_id = authenticator_.session_id();
  heartbeat.challenge = authenticator_.challenge(clock_.now());
  heartbeat.counter = authenticator_.counter();
  heartbeat.ticks = result_.stats.ticks;
  heartbeat.refused = authenticator_.refused();
  heartbeat.has_key = authenticator_.has_key();
  heartbeat.finished = is_finished_;
  return heartbeat;
}

// Status messages for monitors: ten times a second, and at every change.
void LinkedVehiclePort::publish_outputs(const StepInputs& inputs, const StepOutputs& outputs) {
  if (inputs.plan && planning::has_path(inputs.plan->plan.status)) {
    publish(link::channel::kPath,
            link::Path{now_, inputs.plan->plan.clearance_m, inputs.plan->plan.waypoints});
  }
  if (now_ < next_heartbeat_ && outputs.transitions.empty()) return;
  next_heartbeat_ = now_ + kHeartbeatPeriod;
  publish(link::channel::kHeartbeat, heartbeat());
  if (encode(now_, outputs.status, packet_)) bus_.publish(link::channel::kStatus, packet_);
  if (encode(outputs.estimate, packet_)) bus_.publish(link::channel::kEstimate, packet_);
}

// Repeated often enough to be received: without it the supervisor assumes that the executive has
// died.
void LinkedVehiclePort::publish_final() {
  for (int i = 0; i < kFinalRepeats; ++i) {
    publish(link::channel::kHeartbeat, heartbeat());
    if (command_) publish(link::channel::kCommand, *command_);
    bus_.wait(clock_, clock_.now() + kFinalPeriod);
  }
}

LinkedResult LinkedVehiclePort::finish(OnboardReport report) {
  const ExecutiveResult& executive = report.executive;
  const bool is_running = executive.outcome == Outcome::kRunning;
  is_finished_ = !is_running;
  publish_final();
  result_.outcome = is_running ? "failure" : to_string(executive.outcome);
  result_.final_state = executive.final_state;
  result_.cause = executive.cause;
  if (is_running && !yields_to_.empty()) {
    result_.outcome = "aborted";  // over for this executive: it must not be started again
    result_.cause = yields_to_;
  }
  if (is_running && result_.cause.empty()) {
    result_.cause = settings_.lockstep && !inbox_.is_whole(last_)
                        ? "the vehicle fell silent"
                        : fmt::format("still in state {}", executive.final_state);
  }
  result_.duration_s = to_seconds(now_ - began_);
  result_.plans = report.plans;
  result_.replans = report.replans;
  result_.transitions = std::move(report.transitions);
  result_.service_failures = std::move(report.service_failures);
  result_.observed_map = report.observed_map;
  result_.observed_points = std::move(report.observed_points);
  result_.stats.clock_jumps = inbox_.clock_jumps();
  result_.stats.refused = authenticator_.refused();
  result_.stats.rejections = bus_.rejections();
  if (inbox_.cameras() && !settings_.lockstep) result_.stats.cameras = inbox_.cameras()->stats();
  return std::move(result_);
}

}  // namespace

LinkedResult dive_over_link(const Mission& mission, const planning::World& world,
                            const vehicle::Model& model, const LinkSettings& settings,
                            link::Bus& bus, Clock& clock, const LinkObserver& observer,
                            const DiveKeeper& keeper) {
  const OnLate late = settings.lockstep ? OnLate::kBlock : OnLate::kPoll;
  OnboardDive dive(mission, world, model, settings, settings.vision, late);
  LinkedVehiclePort port(mission, world, model, settings, bus, clock, observer);
  if (port.wait_for_vehicle()) return port.finish(dive.run(port, keeper));
  LinkedResult result;
  result.outcome = "failure";
  result.cause = fmt::format("no samples of a vehicle arrived for {:g} s", settings.timeout_s);
  if (bus.rejections().unauthenticated > 0) {
    result.cause += ", only packets without a valid code: give the vehicle the same --key";
  }
  return result;
}

}  // namespace dive::mission
