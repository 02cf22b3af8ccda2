// libFuzzer target: datagrams into the receiving end of the link, and what it delivers into every
// decoder. The input is a list of datagrams: one byte for the sender, of which the highest bit asks
// for an authentic packet, two for the length, and the bytes.
//
//   cmake --preset fuzz && cmake --build --preset fuzz --target fuzz_receiver
//   build/fuzz/fuzz_receiver -max_len=4096 -max_total_time=600
//
// Without libFuzzer (fuzz_receiver_study) the same function gets random and crafted datagrams.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>

#include "vehicle/link/channels.h"
#include "vehicle/link/intake.h"

namespace {

using namespace dive;
using namespace dive::link;

constexpr Key kKey{1, 2, 3};
constexpr std::size_t kMaxBig = 400'000;

void demand(bool is_so) {
  if (!is_so) std::abort();
}

template <typename Value>
void read(PacketView packet) {
  Value value;
  static_cast<void>(decode(packet, value));
}

void read_all(PacketView packet) {
  read<ImuSample>(packet);
  read<DepthSample>(packet);
  read<HealthSample>(packet);
  read<ImageFrame>(packet);
  read<RangeScan>(packet);
  read<VehicleCommand>(packet);
  read<Truth>(packet);
  read<SimTick>(packet);
  read<Heartbeat>(packet);
  read<OperatorRequest>(packet);
  read<OperatorAnswer>(packet);
  read<Presence>(packet);
  read<Path>(packet);
}

/// The short datagram in `bytes` with the trailer of a sender that has the key.
Packet with_trailer(std::span<const std::uint8_t> bytes, std::uint64_t sender,
                    std::uint64_t counter) {
  const std::optional<Datagram> datagram = parse_datagram(bytes);
  Packet whole(bytes.begin(), bytes.end());
  if (!datagram || datagram->fragments != 1 || datagram->channel.empty()) return whole;
  Packet packet(datagram->data.begin(), datagram->data.end());
  seal(kKey, datagram->channel, {static_cast<Role>(sender % 5), sender, counter}, packet);
  whole.resize(static_cast<std::size_t>(datagram->data.data() - bytes.data()));
  whole.insert(whole.end(), packet.begin(), packet.end());
  return whole;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Intake keyless(std::nullopt, 1);
  Intake keyed(kKey, 1);
  for (Intake* intake : {&keyless, &keyed}) {
    intake->subscribe(channel::kDepth, Intake::kMaxFixedSize, Access::kAuthentic);
    intake->subscribe(channel::kRange, kMaxBig, Access::kAuthentic);
    intake->subscribe(channel::kRequest, Intake::kMaxFixedSize, Access::kAnyone);
  }
  std::span<const std::uint8_t> rest(data, size);
  std::uint64_t counter = 0;
  while (rest.size() > 3) {
    const std::uint8_t sender = rest[0];
    const std::size_t length = std::min<std::size_t>(rest[1] * 256U + rest[2], rest.size() - 3);
    const auto bytes = rest.subspan(3, length);
    rest = rest.subspan(3 + length);
    const auto now = static_cast<Utime>(++counter) * 1000;
    keyless.take(bytes, sender, now);
    const bool is_authentic = (sender & 0x80U) != 0;
    keyed.take(
        is_authentic ? with_trailer(bytes, sender, counter) : Packet(bytes.begin(), bytes.end()),
        sender, now);
    static_cast<void>(keyed.take_presence(now));
  }
  while (const auto arrival = keyless.queue().pop()) read_all(arrival->packet);
  while (const auto arrival = keyed.queue().pop()) {
    // No sender has returned a challenge.
    demand(arrival->sender.trust != Trust::kAuthentic && arrival->subscription == 2);
    read_all(arrival->packet);
  }
  return 0;
}
