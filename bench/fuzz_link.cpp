// Sends packets to every decoder of the link and to the decisions on requests: changed copies of
// real ones and noise. No packet may crash the process, make it allocate beyond its bound, or be
// obeyed without authentication. For datagrams see fuzz_receiver.

#include <algorithm>
#include <chrono>
#include <functional>
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

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fuzzes the link.");
  std::int64_t packets = 10'000'000;
  unsigned seed = 1;
  app.add_option("--packets", packets, "Into every channel");
  app.add_option("--seed", seed, "Of the noise");
  CLI11_PARSE(app, argc, argv);

  RequestAuthenticator authenticator({.has_key = true});
  Arbiter arbiter;
  std::int64_t forgeries = 0;
  const OperatorRequest skip{authenticator.session_id(), 1, authenticator.challenge(0),
                             dive::OperatorCommand::kSkip};
  std::vector<Channel> channels = {channel("imu", dive::ImuSample{}),
                                   channel("depth", dive::DepthSample{}),
                                   channel("health", dive::HealthSample{}),
                                   channel("truth", Truth{}),
                                   channel("sim tick", SimTick{1, 2, 3, 4, 5, 6, 7, 4, 8}),
                                   channel("heartbeat", Heartbeat{}),
                                   channel("answer", OperatorAnswer{}),
                                   channel("presence", Presence{1, {{2, 3}, {4, 5}}}),
                                   channel("path", Path{1, 0.5, {{}, {}, {}}}),
                                   channel("command", VehicleCommand{})};
  const Packet command_packet = channels.back().real;
  channels.push_back(channel("image", dive::ImageFrame{1, 0, dive::ImageFrame::Format::kGray8, 8, 4,
                                                       std::vector<std::uint8_t>(32)}));
  channels.push_back(
      channel("range", dive::RangeScan{1, {0.3F, 0, 0}, 10.0F, {{1, 2, 3}, {4, 5, 6}}}));
  // Decoded images are matched to pairs; the inbox holds at most two of each camera.
  dive::mission::CameraInbox cameras;
  const dive::ImageFrame image{1,  0,  dive::ImageFrame::Format::kGray8,
                               16, 16, std::vector<std::uint8_t>(256)};
  channels.push_back(
      {"sight", channel("", image).real, [&, now = dive::Utime{0}](PacketView view) mutable {
         dive::ImageFrame frame;
         if (!decode(view, frame)) return false;
         now += 1000;
         cameras.add(dive::ImuSample{now}, now);
         cameras.add(std::move(frame), now);
         static_cast<void>(cameras.take_inertial());
         static_cast<void>(cameras.take_pair(now));
         return true;
       }});
  channels.push_back({"request", channel("", skip).real, [&](PacketView view) {
                        OperatorRequest request;
                        if (!decode(view, request)) return false;
                        const RequestAuthenticator::Decision decision =
                            authenticator.evaluate(request, Trust::kAnonymous, 0);
                        const bool is_abort = request.command == dive::OperatorCommand::kAbort;
                        if (decision.act && !is_abort) ++forgeries;
                        return true;
                      }});
  channels.push_back({"arbiter", command_packet, [&](PacketView view) {
                        VehicleCommand command;
                        return decode(view, command) && arbiter.receive(command, 0);
                      }});

  bool is_well = true;
  for (Channel& one : channels) {
    std::mt19937_64 random(seed);
    std::int64_t accepted = 0;
    std::size_t largest = 0;
    Packet packet;
    packet.reserve(4 * one.real.size());
    const auto begin = std::chrono::steady_clock::now();
    for (std::int64_t i = 0; i < packets; ++i) {
      std::uint64_t bits = random();
      packet = one.real;
      if (bits % 8 == 0) packet.resize((bits >> 3U) % (2 * one.real.size()));
      for (std::uint64_t changes = (bits >> 20U) % 6; changes > 0 && !packet.empty(); --changes) {
        bits = random();
        packet[(bits >> 8U) % packet.size()] = static_cast<std::uint8_t>(bits);
      }
      dive::testing::reset_allocations();
      accepted += one.receive(packet) ? 1 : 0;
      largest = std::max(largest, dive::testing::allocations().largest);
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    const std::size_t bound = 2 * 2 * one.real.size() + 64;
    is_well = is_well && largest <= bound;
    fmt::print("{:10} {:>9} packets, {:>9} decoded, largest allocation {} of {} bytes, {:.1f} s\n",
               one.name, packets, accepted, largest, bound, took.count());
  }
  fmt::print("{} forgeries accepted\n", forgeries);
  return is_well && forgeries == 0 ? 0 : 1;
}
