#include "mission/link/linked_dive.h"

#include <algorithm>
#include <deque>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/check/simulated_sight.h"
#include "mission/executive/leaf_behaviors.h"
#include "mission/executive/mapper_service.h"
#include "mission/executive/planner_service.h"
#include "mission/executive/stereo_eyes.h"
#include "mission/executive/vision_service.h"
#include "mission/record/log_codec.h"
#include "vehicle/link/sample_clock.h"
#include "vehicle/simulator/named_waters.h"

namespace dive::mission {
namespace {

constexpr Utime kTick = 20'000;  // us
constexpr Utime kHeartbeatPeriod = 100'000;
constexpr std::size_t kMaxRequests = 8;  // that wait for a tick of their own
constexpr int kGoodbyes = 20;
constexpr Utime kGoodbyePeriod = 10'000;  // us

/// What has come since the last tick.
class Inbox {
 public:
  /// Of scans nothing is heard unless `sees`, of pictures and the fast inertial samples nothing but
  /// with cameras, whose pictures are of so many bytes at most.
  Inbox(link::Bus& bus, Clock& clock, bool lockstep, bool sees,
        std::optional<std::size_t> picture_bytes)
      : clock_(clock), lockstep_(lockstep), sees_(sees) {
    bus.listen<ImuSample>(link::channel::kImu,
                          [this](const ImuSample& sample) { keep(imu_, imu_clock_, sample); });
    bus.listen<DepthSample>(link::channel::kDepth, [this](const DepthSample& sample) {
      keep(depth_, depth_clock_, sample);
    });
    bus.listen<HealthSample>(link::channel::kHealth, [this](const HealthSample& sample) {
      keep(health_, health_clock_, sample);
    });
    if (sees_) {
      bus.listen<RangeScan>(
          link::channel::kRange,
          [this](const RangeScan& scan) {
            if (lockstep_ || ahead_) keep(scan_, range_clock_, scan);
          },
          link::kMaxScanPacket);
    }
    if (picture_bytes) listen_for_sight(bus, *picture_bytes);
    bus.listen<link::Truth>(link::channel::kTruth,
                            [this](const link::Truth& truth) { truth_ = truth; });
    bus.listen<link::SimTick>(link::channel::kSimTick, [this](const link::SimTick& tick) {
      is_asked_again_ = tick_ && tick_->utime == tick.utime;
      if (!tick_ || tick.utime >= tick_->utime) tick_ = tick;
    });
    bus.listen<link::OperatorRequest>(link::channel::kRequest,
                                      [this](const link::OperatorRequest& request) {
                                        keep(Request{request, clock_.now()});
                                      });
  }

  struct Request {
    link::OperatorRequest request;
    Utime arrived = 0;
  };

  /// The vehicle's time, of the newest sample; nothing before attitude and depth have come.
  [[nodiscard]] std::optional<Utime> first_time() const {
    if (lockstep_) return is_whole(-1) ? std::optional(tick_->utime) : std::nullopt;
    if (!imu_ || !depth_) return std::nullopt;
    return std::max(imu_->utime, depth_->utime);
  }

  /// In lock-step: has all of a tick come that is later than `last`?
  [[nodiscard]] bool is_whole(Utime last) const {
    const auto has = [](const auto& sample, const std::optional<Utime>& utime) {
      return !utime || (sample && sample->utime == *utime);
    };
    return tick_ && tick_->utime > last && has(imu_, tick_->imu) && has(depth_, tick_->depth) &&
           has(health_, tick_->health) && (!sees_ || has(scan_, tick_->range)) &&
           (!sight_ || sight_->has(*tick_)) && truth_ && truth_->utime == tick_->utime;
  }
  /// In lock-step: the tick that the vehicle is at.
  [[nodiscard]] Utime tick() const { return tick_ ? tick_->utime : -1; }
  /// In lock-step: has the vehicle said the same tick again since this was asked?
  [[nodiscard]] bool is_asked_again() { return std::exchange(is_asked_again_, false); }

  /// Our time is known from now on: `now` by the vehicle's clock, when our clock says `local`.
  void set_time(Utime now, Utime local) { ahead_ = now - local; }

  /// Moves the samples of a tick into `inputs`.
  void take(StepInputs& inputs) {
    const auto move = [this](auto& from, const std::optional<Utime>& utime, auto& to) {
      if (lockstep_ && !utime) return;
      to = from;
      if (!lockstep_) from.reset();
    };
    const link::SimTick tick = tick_.value_or(link::SimTick{});
    move(imu_, tick.imu, inputs.imu);
    move(depth_, tick.depth, inputs.depth);
    move(health_, tick.health, inputs.health);
  }

  /// The scan of a tick.
  [[nodiscard]] std::optional<RangeScan> take_scan() {
    if (lockstep_ && !tick_.value_or(link::SimTick{}).range) return std::nullopt;
    return std::exchange(scan_, std::nullopt);
  }

  /// Where there are cameras: what they and the inertial unit have said.
  [[nodiscard]] std::vector<ImuSample> take_inertial() { return sight_->take_inertial(); }
  [[nodiscard]] StereoPair take_pair(Utime now) {
    return lockstep_ ? sight_->take_pair(*tick_) : sight_->take_pair(now);
  }
  [[nodiscard]] const std::optional<SightInbox>& sight() const { return sight_; }

  [[nodiscard]] std::deque<Request>& requests() { return requests_; }
  [[nodiscard]] const std::optional<link::Truth>& truth() const { return truth_; }
  [[nodiscard]] int clock_jumps() const {
    return imu_clock_.jumps() + depth_clock_.jumps() + health_clock_.jumps() +
           range_clock_.jumps() + (sight_ ? sight_->clock_jumps() : 0);
  }

 private:
  void listen_for_sight(link::Bus& bus, std::size_t picture_bytes) {
    sight_.emplace();
    // Before our time is known nothing can be put on it.
    const auto hear = [this](auto sample) {
      if (lockstep_) {
        sight_->hear(std::move(sample), std::nullopt);
      } else if (ahead_) {
        sight_->hear(std::move(sample), clock_.now() + *ahead_);
      }
    };
    bus.listen<ImuSample>(link::channel::kInertial, hear);
    bus.listen<ImageFrame>(link::channel::kImage, hear, link::image_packet_size(picture_bytes));
  }

  // No flood of anything else keeps an abort out.
  void keep(const Request& request) {
    if (requests_.size() < kMaxRequests) {
      requests_.push_back(request);
    } else if (request.request.command == OperatorCommand::kAbort) {
      requests_.back() = request;
    }
  }

  // The newest, on our clock where the vehicle's may be set.
  template <typename Sample>
  void keep(std::optional<Sample>& kept, link::SampleClock& sample_clock, Sample sample) {
    if (!lockstep_ && ahead_) {
      sample.utime = sample_clock.ours(sample.utime, clock_.now() + *ahead_);
    }
    if (!kept || sample.utime >= kept->utime) kept = std::move(sample);
  }

  Clock& clock_;
  bool lockstep_;
  bool sees_;
  std::optional<Utime> ahead_;  ///< Of the vehicle's time before our clock.
  std::optional<ImuSample> imu_;
  std::optional<DepthSample> depth_;
  std::optional<HealthSample> health_;
  std::optional<RangeScan> scan_;
  std::optional<SightInbox> sight_;
  std::optional<link::Truth> truth_;
  std::optional<link::SimTick> tick_;
  bool is_asked_again_ = false;
  link::SampleClock imu_clock_;
  link::SampleClock depth_clock_;
  link::SampleClock health_clock_;
  link::SampleClock range_clock_;
  std::deque<Request> requests_;
};

/// Where the mission goes by sight: the vehicle's cameras, or the simulated ones.
std::optional<estimation::VisionOptions> vision_of(const Mission& mission,
                                                   const planning::World& world,
                                                   const LinkSettings& settings) {
  if (!goes_by_sight(mission)) return std::nullopt;
  estimation::VisionOptions options =
      settings.vision.value_or(vision_options(*vehicle::stereo_camera_in(mission.water), {}));
  options.tags = known_tags(mission, world);
  return options;
}

/// Of the largest picture of theirs: grey, a byte a pixel.
std::optional<std::size_t> picture_bytes(const std::optional<estimation::VisionOptions>& vision) {
  if (!vision) return std::nullopt;
  std::size_t most = 0;
  for (const CameraModel& camera : vision->filter.cameras) {
    most = std::max(
        most, static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  }
  return most;
}

class LinkedDive {
 public:
  LinkedDive(const Mission& mission, const planning::World& world, const vehicle::Model& model,
             const LinkSettings& settings, link::Bus& bus, Clock& clock)
      : mission_(mission),
        world_(known_world(mission, world)),
        model_(model),
        settings_(settings),
        bus_(bus),
        clock_(clock),
        vision_options_(vision_of(mission, world, settings)),
        inbox_(bus, clock, settings.lockstep, has_range_camera(mission),
               picture_bytes(vision_options_)),
        gate_(settings.key, link::new_boot()),
        planner_(world_, model.hull, planner_options(mission, settings.planner),
                 settings.planner_latency_ticks * kTick, late()) {
    planning::MapperOptions of_map = mapper_options(mission, settings.mapper);
    RangeMaker make_range;
    if (has_stereo_eyes(mission)) {
      const std::vector<CameraModel>& cameras = vision_options_->filter.cameras;
      auto eyes = stereo_eyes(cameras.at(0), cameras.at(1), of_map);
      DIVE_DEMAND(eyes);
      make_range = std::move(eyes->make_range);
      of_map = eyes->mapper;
    }
    if (vision_options_) {
      vision_.emplace(*vision_options_, tracker_seed(settings.seed),
                      settings.vision_latency_ticks * kTick, late(), std::move(make_range),
                      loop_settings(mission, settings.loop_latency_ticks * kTick));
    }
    if (!mission.unknown) return;
    mapper_.emplace(model.hull, of_map, settings.mapper_latency_ticks * kTick, late());
  }

  LinkedResult run(const LinkObserver& observer, const DiveKeeper& keeper) {
    if (!wait_for_vehicle()) {
      result_.outcome = "failure";
      result_.cause = fmt::format("no vehicle was heard for {:g} s", settings_.patience_s);
      return result_;
    }
    executive_.emplace(mission_, world_, model_, executive_options());
    start_time();
    const double longest = longest_dive_s(mission_);
    if (!settings_.lockstep) {  // nothing grows while diving
      result_.stats.lateness_ms.reserve(static_cast<std::size_t>(longest / to_seconds(kTick)) + 1);
    }
    while (executive_->result().outcome == Outcome::kRunning &&
           to_seconds(now_ - began_) < longest) {
      if (!wait_for_tick()) break;
      step(observer, keeper);
    }
    say_goodbye();
    return finish();
  }

 private:
  [[nodiscard]] Late late() const { return settings_.lockstep ? Late::kWait : Late::kNotYet; }

  bool wait_for_vehicle() {
    const Utime deadline = clock_.now() + from_seconds(settings_.patience_s);
    bus_.wait(clock_, deadline, [this] { return inbox_.first_time().has_value(); });
    if (!inbox_.first_time()) return false;
    now_ = *inbox_.first_time();
    return true;
  }

  // What has come while the executive was being built is heard first.
  void start_time() {
    local_ = clock_.now();
    bus_.wait(clock_, local_);
    now_ = began_ = *inbox_.first_time();
    inbox_.set_time(now_, local_);
    last_ = now_ - 1;
  }

  [[nodiscard]] ExecutiveOptions executive_options() const {
    ExecutiveOptions options;
    options.seed = settings_.seed;
    options.resume = settings_.resume;
    return options;
  }

  bool wait_for_tick() { return settings_.lockstep ? wait_in_lockstep() : wait_in_real_time(); }

  bool wait_in_lockstep() {
    const Utime deadline = clock_.now() + from_seconds(settings_.patience_s);
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

  bool wait_in_real_time() {
    if (result_.stats.ticks > 0) now_ += kTick;
    const Utime due = local_ + (now_ - began_);
    bus_.wait(clock_, due);
    const Utime late = clock_.now() - due;
    result_.stats.lateness_ms.push_back(static_cast<float>(static_cast<double>(late) / 1000.0));
    if (late > kTick) {
      result_.stats.skipped += late / kTick;
      now_ += late / kTick * kTick;
    }
    return true;
  }

  void step(const LinkObserver& observer, const DiveKeeper& keeper) {
    StepInputs inputs;
    inputs.now = last_ = now_;
    inbox_.take(inputs);
    const std::optional<Utime> abort_arrived = hear_topside(inputs);
    inputs.plan = planner_.poll(now_);
    if (mapper_) take_map_update(inputs);
    if (vision_) inputs.vision = vision_->poll(now_);
    if (vision_ && mapper_) look(vision_->take_scan());
    const StepOutputs& outputs = executive_->step(inputs);
    if (keeper) keeper(*executive_, outputs);
    command_ = link::VehicleCommand{
        now_,         ++sequence_, link::Source::kExecutive, link::Mode::kRates, outputs.command,
        outputs.rates};
    publish(link::channel::kCommand, *command_);
    if (abort_arrived) {
      result_.stats.abort_ms.push_back(
          static_cast<float>(static_cast<double>(clock_.now() - *abort_arrived) / 1000.0));
    }
    if (mapper_) {
      mapper_->observe(outputs.estimate);
      look(inbox_.take_scan());
    }
    if (vision_) watch(inputs.depth, outputs.estimate);
    if (outputs.plan_query) {
      ++result_.plans;
      if (!outputs.plan_query->request.previous.empty()) ++result_.replans;
      planner_.submit(*outputs.plan_query, now_);
    }
    for (const TransitionRecord& record : outputs.transitions) {
      result_.transitions.push_back({to_seconds(now_ - began_), record});
    }
    result_.distance_m += outputs.estimate.v_WB_B.norm() * to_seconds(kTick);
    ++result_.stats.ticks;
    tell(inputs, outputs);
    if (observer) observer(inputs, outputs, inbox_.truth());
  }

  void take_map_update(StepInputs& inputs) {
    inputs.map_update = mapper_->poll(now_);
    if (!inputs.map_update) return;
    planner_.apply(*inputs.map_update);
    static_cast<void>(result_.seen.apply(*inputs.map_update));
  }

  void look(std::optional<RangeScan> scan) {
    if (scan) mapper_->submit(std::move(*scan), now_);
  }

  void watch(const std::optional<DepthSample>& depth, const estimation::StateEstimate& estimate) {
    vision_->hear(inbox_.take_inertial());
    if (depth) vision_->hear(*depth);
    vision_->observe(estimate);
    auto [left, right] = inbox_.take_pair(now_);
    vision_->submit(std::move(left), std::move(right), now_);
  }

  // One request a tick, an abort before all others. When it arrived, if it was an abort.
  std::optional<Utime> hear_topside(StepInputs& inputs) {
    std::deque<Inbox::Request>& requests = inbox_.requests();
    std::stable_partition(requests.begin(), requests.end(), [](const Inbox::Request& request) {
      return request.request.command == OperatorCommand::kAbort;
    });
    std::optional<Utime> abort_arrived;
    while (!requests.empty() && !inputs.operator_command) {
      const Inbox::Request heard = requests.front();
      requests.pop_front();
      const link::Gate::Ruling ruling = gate_.judge(heard.request, now_);
      publish(link::channel::kAnswer, ruling.answer);
      if (!ruling.act) continue;
      inputs.operator_command = heard.request.command;
      if (heard.request.command == OperatorCommand::kAbort) abort_arrived = heard.arrived;
    }
    return abort_arrived;
  }

  template <typename Value>
  void publish(const char* channel, const Value& value) {
    if (link::encode(value, packet_)) bus_.publish(channel, packet_);
  }

  [[nodiscard]] link::Heartbeat heartbeat() const {
    link::Heartbeat heartbeat;
    heartbeat.utime = now_;
    heartbeat.boot = gate_.boot();
    heartbeat.counter = gate_.counter();
    heartbeat.ticks = result_.stats.ticks;
    heartbeat.refused = gate_.refused();
    heartbeat.keyed = gate_.has_key();
    heartbeat.finished = executive_->result().outcome != Outcome::kRunning;
    return heartbeat;
  }

  // Those who watch: ten times a second, and whenever something happens.
  void tell(const StepInputs& inputs, const StepOutputs& outputs) {
    if (inputs.plan && inputs.plan->status == planning::PlanStatus::kSuccess) {
      publish(link::channel::kPath,
              link::Path{now_, inputs.plan->clearance_m, inputs.plan->waypoints});
    }
    if (now_ < next_heartbeat_ && outputs.transitions.empty()) return;
    next_heartbeat_ = now_ + kHeartbeatPeriod;
    publish(link::channel::kHeartbeat, heartbeat());
    if (encode(now_, outputs.status, packet_)) bus_.publish(link::channel::kStatus, packet_);
    if (encode(outputs.estimate, packet_)) bus_.publish(link::channel::kEstimate, packet_);
  }

  // So often that it is heard: who misses it takes us for dead.
  void say_goodbye() {
    for (int i = 0; i < kGoodbyes; ++i) {
      publish(link::channel::kHeartbeat, heartbeat());
      if (command_) publish(link::channel::kCommand, *command_);
      bus_.wait(clock_, clock_.now() + kGoodbyePeriod);
    }
  }

  LinkedResult finish() {
    const ExecutiveResult executive = executive_->result();
    result_.outcome =
        executive.outcome == Outcome::kRunning ? "failure" : to_string(executive.outcome);
    result_.final_state = executive.final_state;
    result_.cause = executive.cause;
    if (executive.outcome == Outcome::kRunning && result_.cause.empty()) {
      result_.cause = settings_.lockstep && !inbox_.is_whole(last_)
                          ? "the vehicle fell silent"
                          : fmt::format("still in state {}", executive.final_state);
    }
    result_.duration_s = to_seconds(now_ - began_);
    result_.stats.clock_jumps = inbox_.clock_jumps();
    result_.stats.refused = gate_.refused();
    result_.stats.malformed = bus_.malformed();
    if (inbox_.sight() && !settings_.lockstep) result_.stats.sight = inbox_.sight()->stats();
    if (mapper_) result_.seen_points = mapper_->points();
    return result_;
  }

  const Mission& mission_;
  const planning::World world_;  ///< As far as it is known.
  const vehicle::Model& model_;
  const LinkSettings& settings_;
  link::Bus& bus_;
  Clock& clock_;
  const std::optional<estimation::VisionOptions> vision_options_;  ///< Where it goes by sight.
  Inbox inbox_;
  link::Gate gate_;
  PlannerService planner_;
  std::optional<MapperService> mapper_;  ///< In unknown water.
  std::optional<VisionService> vision_;  ///< Where it goes by sight.
  std::optional<Executive> executive_;
  std::optional<link::VehicleCommand> command_;  ///< The last.
  std::int64_t sequence_ = 0;
  Utime began_ = 0;  ///< On the vehicle's clock ...
  Utime local_ = 0;  ///< ... and on ours.
  Utime now_ = 0;
  Utime last_ = 0;
  Utime next_heartbeat_ = 0;
  link::Packet packet_;
  LinkedResult result_;
};

}  // namespace

LinkedResult dive_over_link(const Mission& mission, const planning::World& world,
                            const vehicle::Model& model, const LinkSettings& settings,
                            link::Bus& bus, Clock& clock, const LinkObserver& observer,
                            const DiveKeeper& keeper) {
  return LinkedDive(mission, world, model, settings, bus, clock).run(observer, keeper);
}

}  // namespace dive::mission
