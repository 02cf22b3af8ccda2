// Sends packets to every decoder of the link and to the decisions on requests: changed copies of
// real ones and noise. No packet may crash the process, make it allocate beyond its bound, or be
// obeyed without authentication. For datagrams see fuzz_receiver.

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "mission/link/camera_inbox.h"
#include "test/common/allocations.h"
#include "vehicle/link/arbiter.h"
#include "vehicle/link/authority.h"

namespace {

using namespace dive::link;

struct Channel {
  std::string name;
  Packet real;
  std::function<bool(PacketView)> receive;
};

template <typename Value>
Channel channel(const char* name, const Value& value) {
  Packet packet;
  if (!encode(value, packet)) std::abort();
  return {name, packet, [](PacketView view) {
            Value decoded;
            return decode(view, decoded);
          }};
}

std::vector<Channel> plain_channels() {
  return {channel("imu", dive::ImuSample{}),
          channel("depth", dive::DepthSample{}),
          channel("health", dive::HealthSample{}),
          channel("truth", Truth{}),
          channel("sim tick", SimTick{1, 2, 3, 4, 5, 6, 7, 4, 8}),
          channel("heartbeat", Heartbeat{}),
          channel("answer", OperatorAnswer{}),
          channel("presence", Presence{1, {{2, 3}, {4, 5}}}),
          channel("path", Path{1, 0.5, {{}, {}, {}}}),
          channel("exit path", ExitPathMessage{1, {.waypoints = {{}, {}, {}}}}),
          channel("command", VehicleCommand{}),
          channel("image", dive::ImageFrame{1, 0, dive::ImageFrame::Format::kGray8, 8, 4,
                                            std::vector<std::uint8_t>(32)}),
          channel("range", dive::RangeScan{1, {0.3F, 0, 0}, 10.0F, {{1, 2, 3}, {4, 5, 6}}})};
}

// Decoded images are matched to pairs; the inbox holds at most two of each camera.
Channel paired_images() {
  const dive::ImageFrame image{1,  0,  dive::ImageFrame::Format::kGray8,
                               16, 16, std::vector<std::uint8_t>(256)};
  auto cameras = std::make_shared<dive::mission::CameraInbox>();
  return {"paired", channel("", image).real,
          [cameras, now = dive::Utime{0}](PacketView view) mutable {
            dive::ImageFrame frame;
            if (!decode(view, frame)) return false;
            now += 1000;
            cameras->add(dive::ImuSample{now}, now);
            cameras->add(std::move(frame), now);
            static_cast<void>(cameras->take_inertial());
            static_cast<void>(cameras->take_pair(now));
            return true;
          }};
}

/// Counts in `forgeries` what it would obey.
Channel requests(std::int64_t& forgeries) {
  auto authenticator = std::make_shared<RequestAuthenticator>(RequestPolicy{.has_key = true});
  const OperatorRequest skip{authenticator->session_id(), 1, authenticator->challenge(0),
                             dive::OperatorCommand::kSkip};
  return {"request", channel("", skip).real, [authenticator, &forgeries](PacketView view) {
            OperatorRequest request;
            if (!decode(view, request)) return false;
            const auto decision = authenticator->evaluate(request, Trust::kAnonymous, 0);
            const bool is_abort = request.command == dive::OperatorCommand::kAbort;
            if (decision.act && !is_abort) ++forgeries;
            return true;
          }};
}

Channel arbitrated_commands() {
  return {"arbiter", channel("", VehicleCommand{}).real,
          [arbiter = std::make_shared<Arbiter>()](PacketView view) {
            VehicleCommand command;
            return decode(view, command) && arbiter->receive(command, 0);
          }};
}

/// Up to five changed bytes; in one of eight packets another size.
void damage(Packet& packet, std::mt19937_64& random) {
  std::uint64_t bits = random();
  if (bits % 8 == 0) packet.resize((bits >> 3U) % (2 * packet.size()));
  for (std::uint64_t changes = (bits >> 20U) % 6; changes > 0 && !packet.empty(); --changes) {
    bits = random();
    packet[(bits >> 8U) % packet.size()] = static_cast<std::uint8_t>(bits);
  }
}

/// False if an allocation exceeded its bound.
bool fuzz(Channel& one, std::int64_t packets, unsigned seed) {
  std::mt19937_64 random(seed);
  std::int64_t accepted = 0;
  std::size_t largest = 0;
  Packet packet;
  packet.reserve(4 * one.real.size());
  const auto begin = std::chrono::steady_clock::now();
  for (std::int64_t i = 0; i < packets; ++i) {
    packet = one.real;
    damage(packet, random);
    dive::testing::reset_allocations();
    accepted += one.receive(packet) ? 1 : 0;
    largest = std::max(largest, dive::testing::allocations().largest);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const std::size_t bound = 2 * 2 * one.real.size() + 64;
  fmt::print("{:10} {:>9} packets, {:>9} decoded, largest allocation {} of {} bytes, {:.1f} s\n",
             one.name, packets, accepted, largest, bound, took.count());
  return largest <= bound;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fuzzes the link.");
  std::int64_t packets = 10'000'000;
  unsigned seed = 1;
  app.add_option("--packets", packets, "Into every channel");
  app.add_option("--seed", seed, "Of the noise");
  CLI11_PARSE(app, argc, argv);

  std::int64_t forgeries = 0;
  std::vector<Channel> channels = plain_channels();
  channels.push_back(paired_images());
  channels.push_back(requests(forgeries));
  channels.push_back(arbitrated_commands());
  bool is_bounded = true;
  for (Channel& one : channels) is_bounded = fuzz(one, packets, seed) && is_bounded;
  fmt::print("{} forgeries accepted\n", forgeries);
  return is_bounded && forgeries == 0 ? 0 : 1;
}
