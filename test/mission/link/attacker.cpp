#include "test/mission/link/attacker.h"

#include <lcm/lcm.h>

namespace dive::mission::testing {
namespace {

constexpr Utime kFuture = 100'000'000'000'000'000;
constexpr const char* kRecorded[] = {link::channel::kCommand,   link::channel::kAhrs,
                                     link::channel::kDepth,     link::channel::kHealth,
                                     link::channel::kHeartbeat, link::channel::kRequest,
                                     link::channel::kPresence};

}  // namespace

class Recording {
 public:
  Recording(const char* channel, const std::string& url)
      : channel_(channel), lcm_(lcm_create(url.c_str()), &lcm_destroy) {
    lcm_subscribe(lcm_.get(), channel, keep, this);
  }

  void play(const link::testing::DatagramSender& to) {
    constexpr std::size_t kEnough = 1000;
    constexpr std::size_t kMaxPlayed = 20;
    while (packets_.size() < kEnough && lcm_handle_timeout(lcm_.get(), 0) > 0) {
    }
    const std::size_t stride = 1 + packets_.size() / kMaxPlayed;
    for (std::size_t i = 0; i < packets_.size(); i += stride) {
      to.send(link::testing::short_datagram(channel_, packets_[i]));
    }
  }

 private:
  static void keep(const lcm_recv_buf_t* buffer, const char* /*channel*/, void* user) {
    const auto* data = static_cast<const std::uint8_t*>(buffer->data);
    static_cast<Recording*>(user)->packets_.emplace_back(data, data + buffer->data_size);
  }

  std::string channel_;
  std::unique_ptr<lcm_t, decltype(&lcm_destroy)> lcm_;
  std::vector<link::Packet> packets_;
};

Attacker::Attacker(const std::string& url)
    : sender_(*link::parse_udpm_url(url)), bus_(*link::Bus::open(url)) {
  for (const char* channel : kRecorded) {
    recordings_.push_back(std::make_unique<Recording>(channel, url));
  }
}

Attacker::~Attacker() = default;

template <typename Value>
void Attacker::forge(const char* channel, const Value& value) {
  if (link::encode(value, packet_)) bus_.publish(channel, packet_);
}

// Not the datagram that ends LCM: the recordings are by LCM.
void Attacker::attack() {
  for (const auto source : {link::Source::kExecutive, link::Source::kSupervisor}) {
    link::VehicleCommand command;
    command.utime = kFuture;
    command.source = source;
    command.rates.surge = 1.0;
    forge(link::channel::kCommand, command);
  }
  forge(link::channel::kDepth, DepthSample{.utime = kFuture, .depth_m = 400.0});
  ImuSample imu;
  imu.utime = kFuture;
  forge(link::channel::kAhrs, imu);
  HealthSample health;
  health.leak = true;
  forge(link::channel::kHealth, health);
  link::Heartbeat heartbeat;
  heartbeat.finished = true;
  forge(link::channel::kHeartbeat, heartbeat);
  for (const auto command :
       {OperatorCommand::kAbort, OperatorCommand::kPause, OperatorCommand::kSkip}) {
    forge(link::channel::kRequest, link::OperatorRequest{0, 1, 0, command});
  }
  for (const auto& recording : recordings_) recording->play(sender_);
}

}  // namespace dive::mission::testing
