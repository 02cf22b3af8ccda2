#include "mission/simulation/simulated_vehicle.h"

#include <algorithm>
#include <utility>

#include "mission/simulation/contacts.h"
#include "mission/simulation/simulated_cameras.h"
#include "vehicle/command_timing.h"
#include "vehicle/going_home.h"
#include "vehicle/link/arbiter.h"
#include "vehicle/simulator/drawn_world.h"

namespace dive::mission {
namespace {

constexpr Utime kFirstRepetition =
    5'000;  // us of real time before the first repetition, in lock-step
// us: limit of the interval, which doubles each time; an executive that waits for its own worker
// has received the samples
constexpr Utime kMaxRepetition = 80'000;
// us without an answer: the executive has died; on a slow machine planning for one tick may take
// long
constexpr Utime kGiveUp = 120'000'000;
constexpr double kRestAtSurface = 5.0;  // s

/// The samples of one tick, as the link carries them.
struct TickSamples {
  StepInputs inputs;  ///< AHRS, depth and health.
  std::optional<RangeScan> scan;
  vehicle::StereoFrames images;
  vehicle::InertialSamples inertial;

  void shift(Utime by) {
    if (inputs.imu) inputs.imu->utime += by;
    if (inputs.depth) inputs.depth->utime += by;
    if (inputs.health) inputs.health->utime += by;
    if (scan) scan->utime += by;
    for (ImuSample& sample : inertial.samples) sample.utime += by;
    for (std::optional<ImageFrame>& image : images) {
      if (image) image->utime += by;
    }
  }
};

class SamplePublisher {
 public:
  explicit SamplePublisher(link::Bus& bus) : bus_(bus) {}

  template <typename Value>
  void publish(const char* channel, const Value& value) {
    if (link::encode(value, packet_)) bus_.publish(channel, packet_);
  }

  /// Returns which samples it has published.
  link::SimTick publish(const TickSamples& samples, Utime now) {
    link::SimTick tick;
    tick.utime = now;
    const auto add = [&](const char* channel, const auto& sample, std::optional<Utime>& time) {
      if (!sample) return;
      time = sample->utime;
      publish(channel, *sample);
    };
    add(link::channel::kAhrs, samples.inputs.imu, tick.ahrs);
    add(link::channel::kDepth, samples.inputs.depth, tick.depth);
    add(link::channel::kHealth, samples.inputs.health, tick.health);
    add(link::channel::kRange, samples.scan, tick.range);
    for (const ImuSample& sample : samples.inertial.list()) {
      publish(link::channel::kImu, sample);
      ++tick.imu_samples;
      tick.last_imu = sample.utime;
    }
    add(link::channel::kImage, samples.images[0], tick.left);
    add(link::channel::kImage, samples.images[1], tick.right);
    return tick;
  }

 private:
  link::Bus& bus_;
  link::Packet packet_;
};

class SimulatedVehicle {
 public:
  SimulatedVehicle(const planning::World& map, const vehicle::Model& model, const Pose& start,
                   const VehicleSettings& settings, link::Bus& bus, Clock& clock)
      : SimulatedVehicle(model, start, settings, bus, clock,
                         vehicle::drawn_world(map, settings.conditions, settings.seed)) {}

  VehicleReport run(const VehicleWanted& wanted) {
    Utime next = clock_.now();
    while (report_.ended.empty() && is_wanted(wanted)) {
      tick();
      next += from_seconds(vehicle::Simulator::kTick);
      if (settings_.lockstep && !is_alone_) {
        wait_for_command(wanted);
      } else if (!has_begun_ && !arbiter_.executive() && samples_.inputs.imu &&
                 samples_.inputs.depth) {
        wait_for_first_command(wanted);
        next = clock_.now();
      } else {
        if (!is_away()) publish_samples();
        bus_.wait(clock_, next, [this] { return settings_.lockstep && is_answered(); });
        is_alone_ = is_alone_ && !is_answered();
      }
      // Time lost by a slow machine is not made up, because a vehicle's time passes.
      next = std::max(next, clock_.now() - from_seconds(vehicle::Simulator::kTick));
      update_report();
    }
    return report();
  }

 private:
  SimulatedVehicle(const vehicle::Model& model, const Pose& start, const VehicleSettings& settings,
                   link::Bus& bus, Clock& clock, const planning::World& world)
      : settings_(settings),
        bus_(bus),
        clock_(clock),
        simulator_(model, start,
                   settings.cameras ? with_imu(settings.conditions) : settings.conditions,
                   settings.seed),
        X_MW_(vehicle::drawn_map_motion(settings.conditions, settings.seed).inverse()),
        contacts_(vehicle::TriangulatedWorld(world), model.hull, std::nullopt, X_MW_),
        injector_(settings.faults),
        arbiter_(make_arbiter()),
        publisher_(bus) {
    if (settings.range_camera) {
      camera_.emplace(world,
                      vehicle::drawn_range_camera(*settings.range_camera,
                                                  settings.conditions.range_misalignment_sigma_deg,
                                                  settings.seed),
                      settings.seed);
    }
    if (settings.cameras) {
      cameras_.emplace(world, *settings.cameras, settings.conditions, settings.seed);
    }
    bus_.listen<link::VehicleCommand>(link::channel::kCommand,
                                      [this](const link::VehicleCommand& command) {
                                        if (!is_away()) arbiter_.receive(command, now());
                                      });
    bus_.listen<link::ExitPathMessage>(
        link::channel::kExitPath,
        [this](const link::ExitPathMessage& message) {
          if (!is_away()) arbiter_.receive(message);
        },
        link::kMaxExitPathPacket);
    bus_.listen<link::Heartbeat>(link::channel::kHeartbeat,
                                 [this](const link::Heartbeat& heartbeat) {
                                   if (arbiter_.is_from_executive(heartbeat.session_id))
                                     finished_ = heartbeat.finished;
                                 });
  }

  [[nodiscard]] Utime now() const { return simulator_.truth().utime; }
  /// The true pose relative to the map.
  [[nodiscard]] Pose true_X_MB() const { return X_MW_ * simulator_.truth().X_WB; }

  [[nodiscard]] bool is_wanted(const VehicleWanted& wanted) {
    if (wanted()) return true;
    report_.ended = "interrupted";
    return false;
  }

  // The vehicle's time stops with an executive in lock-step: another one is obeyed at once.
  [[nodiscard]] link::Arbiter make_arbiter() const {
    return link::Arbiter({}, settings_.lockstep ? 0.0 : to_seconds(vehicle::kSessionTimeout));
  }

  /// The driver is being restarted.
  [[nodiscard]] bool is_away() const {
    const std::optional<DriverRestart>& restart = settings_.driver_restart;
    const double t = to_seconds(now());
    return restart && t >= restart->at_s && t < restart->at_s + restart->away_s;
  }

  // Commands, exit path and time base of the driver are lost.
  void restart_driver() {
    const std::optional<DriverRestart>& restart = settings_.driver_restart;
    if (!restart || to_seconds(now()) < restart->at_s) return;
    if (!std::exchange(has_restarted_, true)) {
      report_.refused += arbiter_.refused();
      arbiter_ = make_arbiter();
    }
    samples_.shift(-from_seconds(restart->at_s + restart->away_s));
  }

  void tick() {
    has_begun_ = has_begun_ || arbiter_.executive();
    const vehicle::SensorSamples samples = simulator_.step(rates_);
    samples_.inputs = {};
    samples_.inputs.now = now();
    samples_.inputs.imu = samples.imu;
    samples_.inputs.depth = samples.depth;
    samples_.inputs.health = samples.health;
    // Faults of the link do not affect the vehicle's own autopilot.
    const StepInputs own = samples_.inputs;
    std::vector<AppearingObstacle> ignored;  // no message of the link could report them
    injector_.apply(simulator_.truth(), samples_.inputs, ignored);
    samples_.inertial = samples.inertial;
    injector_.apply(samples_.inertial);
    sense_surroundings();
    set_clock();
    restart_driver();
    touched_ = contacts_.observe(now(), simulator_.truth().X_WB);
    for (Collision& collision : collisions_at(now(), true_X_MB(), touched_, {})) {
      report_.collisions.push_back(std::move(collision));
    }
    own_ = {own.imu, own.depth};
  }

  void sense_surroundings() {
    if (cameras_) samples_.images = cameras_->render(simulator_.truth(), std::nullopt, injector_);
    samples_.scan.reset();
    if (!camera_ || !camera_->due(now())) return;
    camera_->set_frozen(injector_.is_on(FaultKind::kRangeFrozen));
    samples_.scan = camera_->take(now(), simulator_.truth().X_WB);
    if (injector_.is_on(FaultKind::kRangeSilent)) samples_.scan.reset();
  }

  void set_clock() {
    const std::optional<ClockJump>& jump = settings_.clock_jump;
    if (!jump || to_seconds(now()) < jump->at_s) return;
    samples_.shift(from_seconds(jump->by_s));
  }

  void publish_samples() {
    const link::SimTick tick = publisher_.publish(samples_, now());
    const NearestApproach& nearest = contacts_.nearest();
    publisher_.publish(link::channel::kTruth, link::Truth{now(), true_X_MB(), touched_,
                                                          nearest.clearance_m, nearest.obstacle});
    if (settings_.lockstep) publisher_.publish(link::channel::kSimTick, tick);
  }

  [[nodiscard]] bool is_answered() const {
    return arbiter_.executive() && arbiter_.executive()->utime == now();
  }

  // The dive begins with the first command; no dive time passes between the first samples and that
  // command.
  void wait_for_first_command(const VehicleWanted& wanted) {
    while (!arbiter_.executive() && is_wanted(wanted)) {
      publish_samples();
      bus_.wait(clock_, clock_.now() + from_seconds(vehicle::Simulator::kTick),
                [this] { return arbiter_.executive().has_value(); });
    }
  }

  void wait_for_command(const VehicleWanted& wanted) {
    const Utime asked = clock_.now();
    Utime pause = kFirstRepetition;
    while (!is_answered() && !finished_ && is_wanted(wanted)) {
      publish_samples();
      bus_.wait(clock_, clock_.now() + pause, [this] { return is_answered() || finished_; });
      pause = std::min(2 * pause, kMaxRepetition);
      const bool has_begun = arbiter_.executive().has_value();
      if (has_begun && clock_.now() - asked > kGiveUp) {
        is_alone_ = true;
        return;
      }
    }
  }

  void update_report() {
    const vehicle::GroundTruth& truth = simulator_.truth();
    const auto who = arbiter_.source(now());
    if (has_begun_) {
      if (who == link::Arbiter::CommandSource::kNone) report_.silent_s += vehicle::Simulator::kTick;
      if (who == link::Arbiter::CommandSource::kSupervisor) {
        report_.supervised_s += vehicle::Simulator::kTick;
      }
    }
    rates_ = is_away() ? vehicle::PseudoRates{} : arbiter_.step(own_.imu, own_.depth, now());
    const bool is_up = -truth.X_WB.p.z() < vehicle::kSurfaceDepth;
    const bool is_led = who == link::Arbiter::CommandSource::kExecutive;
    if (!is_up || is_led || !has_begun_) up_since_ = now();
    const bool is_quiet = settings_.lockstep || !is_led;
    if (finished_ && is_quiet) report_.ended = "finished";
    if (to_seconds(now() - up_since_) > kRestAtSurface) report_.ended = "surfaced";
    if (to_seconds(now()) >= settings_.max_seconds) report_.ended = "time";
  }

  VehicleReport report() {
    const vehicle::GroundTruth& truth = simulator_.truth();
    report_.duration_s = to_seconds(now());
    report_.distance_m = truth.distance_swum_m;
    report_.nearest = contacts_.nearest();
    report_.final_depth_m = -truth.X_WB.p.z();
    report_.energy_wh = truth.energy_used_wh;
    report_.refused += arbiter_.refused();
    return report_;
  }

  struct OwnSamples {
    std::optional<ImuSample> imu;
    std::optional<DepthSample> depth;
  };

  const VehicleSettings& settings_;
  link::Bus& bus_;
  Clock& clock_;
  vehicle::Simulator simulator_;
  const Pose X_MW_;  ///< From the simulated world to the map.
  Contacts contacts_;
  std::optional<vehicle::RangeCamera> camera_;
  FaultInjector injector_;
  link::Arbiter arbiter_;
  vehicle::PseudoRates rates_;
  TickSamples samples_;
  std::optional<SimulatedCameras> cameras_;
  std::vector<std::string> touched_;  ///< Obstacles touched in this tick.
  OwnSamples own_;
  SamplePublisher publisher_;
  bool finished_ = false;
  bool has_begun_ = false;      ///< The first command has arrived.
  bool has_restarted_ = false;  ///< The driver was restarted.
  bool is_alone_ = false;
  Utime up_since_ = 0;
  VehicleReport report_;
};

}  // namespace

VehicleReport simulate_vehicle(const planning::World& world, const vehicle::Model& model,
                               const Pose& start_X_WB, const VehicleSettings& settings,
                               link::Bus& bus, Clock& clock, const VehicleWanted& wanted) {
  return SimulatedVehicle(world, model, start_X_WB, settings, bus, clock).run(wanted);
}

}  // namespace dive::mission
