// Relays packets between a vehicle and an executive in lock-step, and drops samples permanently: a
// dropped sample is also removed from the tick's list, so that the executive does not wait for it.
// The dropped samples depend on the seed alone, never on the machine. Packets of the executive are
// dropped at random; the vehicle repeats its samples.
//
//    lockstep_relay VEHICLE_URL EXECUTIVE_URL LOSS SEED

#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <thread>

#include "vehicle/link/bus.h"

namespace {

using dive::Utime;
namespace link = dive::link;

enum class Kind : unsigned { kImu, kDepth, kHealth, kRange, kInertial, kLeft, kRight };

struct Loss {
  double share = 0.0;
  unsigned seed = 0;

  [[nodiscard]] bool takes(Kind kind, Utime utime) const {
    std::seed_seq words{seed, static_cast<unsigned>(kind), static_cast<unsigned>(utime),
                        static_cast<unsigned>(utime >> 32U)};
    std::mt19937 generator(words);
    return std::uniform_real_distribution<>(0.0, 1.0)(generator) < share;
  }
};

class ToExecutive {
 public:
  ToExecutive(const std::string& from, const std::string& to, Loss loss)
      : from_(*link::Bus::open(from, {.receive_bytes = kReceiveBytes})),
        to_(*link::Bus::open(to)),
        loss_(loss) {
    pass<dive::ImuSample>(link::channel::kAhrs, Kind::kImu);
    pass<dive::DepthSample>(link::channel::kDepth, Kind::kDepth);
    pass<dive::HealthSample>(link::channel::kHealth, Kind::kHealth);
    pass<dive::RangeScan>(link::channel::kRange, Kind::kRange, link::kMaxScanPacket);
    from_.listen<dive::ImuSample>(link::channel::kImu, [this](const dive::ImuSample& sample) {
      const bool is_lost = loss_.takes(Kind::kInertial, sample.utime);
      inertial_[sample.utime] = is_lost;
      if (!is_lost) publish(link::channel::kImu, sample);
    });
    from_.listen<dive::ImageFrame>(
        link::channel::kImage,
        [this](const dive::ImageFrame& frame) {
          const Kind kind = frame.camera == 0 ? Kind::kLeft : Kind::kRight;
          if (!loss_.takes(kind, frame.utime)) publish(link::channel::kImage, frame);
        },
        link::image_packet_size(752 * 480));
    from_.listen<link::Truth>(
        link::channel::kTruth,
        [this](const link::Truth& truth) { publish(link::channel::kTruth, truth); },
        link::kMaxTruthPacket);
    from_.listen<link::SimTick>(link::channel::kSimTick,
                                [this](const link::SimTick& tick) { hand_on(tick); });
  }

  void run() {
    dive::SteadyClock clock;
    for (;;) from_.wait(clock, clock.now() + dive::kMicrosecondsPerSecond);
  }

 private:
  static constexpr int kReceiveBytes = 8 << 20;

  template <typename Sample>
  void pass(const char* channel, Kind kind, std::size_t max_bytes = link::Bus::kMaxFixedSize) {
    from_.listen<Sample>(
        channel,
        [this, channel, kind](const Sample& sample) {
          if (!loss_.takes(kind, sample.utime)) publish(channel, sample);
        },
        max_bytes);
  }

  template <typename Value>
  void publish(const char* channel, const Value& value) {
    if (link::encode(value, packet_)) to_.publish(channel, packet_);
  }

  void hand_on(link::SimTick tick) {
    const auto lose = [this](Kind kind, std::optional<Utime>& utime) {
      if (utime && loss_.takes(kind, *utime)) utime.reset();
    };
    lose(Kind::kImu, tick.ahrs);
    lose(Kind::kDepth, tick.depth);
    lose(Kind::kHealth, tick.health);
    lose(Kind::kRange, tick.range);
    lose(Kind::kLeft, tick.left);
    lose(Kind::kRight, tick.right);
    if (tick.imu_samples == 0 || take_inertial(tick)) publish(link::channel::kSimTick, tick);
  }

  // Returns false if the tick is incomplete: the vehicle sends it again.
  bool take_inertial(link::SimTick& tick) {
    if (tick.utime != tick_) before_tick_ = last_inertial_;
    tick_ = tick.utime;
    last_inertial_ = tick.last_imu;
    const auto first = inertial_.upper_bound(before_tick_);
    const auto end = inertial_.upper_bound(last_inertial_);
    if (std::distance(first, end) < tick.imu_samples) return false;
    tick.imu_samples = 0;
    tick.last_imu = 0;
    for (auto sample = first; sample != end; ++sample) {
      if (sample->second) continue;
      ++tick.imu_samples;
      tick.last_imu = sample->first;
    }
    return true;
  }

  link::Bus from_;
  link::Bus to_;
  Loss loss_;
  link::Packet packet_;
  std::map<Utime, bool> inertial_;  // All received samples, and whether each is dropped.
  Utime tick_ = -1;
  Utime last_inertial_ = -1;  // Last sample of the newest tick.
  Utime before_tick_ = -1;    // Last sample of the tick before.
};

void hand_back(const std::string& from_url, const std::string& to_url, Loss loss) {
  link::Bus from = *link::Bus::open(from_url);
  link::Bus to = *link::Bus::open(to_url);
  std::mt19937 generator(loss.seed);
  const auto pass = [&](const char* channel, std::size_t max_bytes = link::Bus::kMaxFixedSize) {
    from.subscribe(channel, max_bytes, [&, channel](link::PacketView packet) {
      if (std::uniform_real_distribution<>(0.0, 1.0)(generator) >= loss.share) {
        to.publish(channel, {packet.begin(), packet.end()});
      }
      return true;
    });
  };
  pass(link::channel::kCommand);
  pass(link::channel::kHeartbeat);
  pass(link::channel::kExitPath, link::kMaxExitPathPacket);
  dive::SteadyClock clock;
  for (;;) from.wait(clock, clock.now() + dive::kMicrosecondsPerSecond);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const Loss loss{std::atof(argv[3]), static_cast<unsigned>(std::atoi(argv[4]))};
  const std::jthread back(hand_back, std::string(argv[2]), std::string(argv[1]), loss);
  ToExecutive(argv[1], argv[2], loss).run();
}
