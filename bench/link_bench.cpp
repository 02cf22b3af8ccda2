// Cost of authentication for each packet. Reference: HMAC-SHA-512/256 of libsodium over the same
// bytes, and for a whole arrival the same without a key.

#include <array>
#include <cstdlib>
#include <optional>
#include <vector>

#include <benchmark/benchmark.h>
#include <sodium.h>

#include "test/vehicle/link/datagrams.h"
#include "vehicle/link/channels.h"
#include "vehicle/link/intake.h"

namespace {

using namespace dive;
using namespace dive::link;

constexpr std::int64_t kCommandSize = 126;
constexpr std::int64_t kScanSize = 90'036;
constexpr std::int64_t kImageSize = 360'990;

void BM_ReferenceHmac(benchmark::State& state) {
  const Key key = new_key();
  const Packet packet(static_cast<std::size_t>(state.range(0)));
  std::array<std::uint8_t, crypto_auth_BYTES> code;
  for (auto _ : state) {
    crypto_auth(code.data(), packet.data(), packet.size(), key.data());
    benchmark::DoNotOptimize(code);
  }
}
BENCHMARK(BM_ReferenceHmac)->Arg(kCommandSize)->Arg(kScanSize)->Arg(kImageSize);

void BM_Seal(benchmark::State& state) {
  const Key key = new_key();
  const auto size = static_cast<std::size_t>(state.range(0));
  Packet packet(size);
  Trailer trailer{Role::kVehicle, 1, 0};
  for (auto _ : state) {
    packet.resize(size);
    ++trailer.counter;
    seal(key, channel::kCommand, trailer, packet);
    benchmark::DoNotOptimize(packet.data());
  }
}
BENCHMARK(BM_Seal)->Arg(kCommandSize)->Arg(kScanSize)->Arg(kImageSize);

void BM_Authenticate(benchmark::State& state) {
  const Key key = new_key();
  Packet packet(static_cast<std::size_t>(state.range(0)));
  seal(key, channel::kCommand, {Role::kVehicle, 1, 1}, packet);
  for (auto _ : state) benchmark::DoNotOptimize(authenticate(key, channel::kCommand, packet));
}
BENCHMARK(BM_Authenticate)->Arg(kCommandSize)->Arg(kScanSize)->Arg(kImageSize);

/// From a datagram to its packet in the queue, and out of it.
void arrive(benchmark::State& state, const std::optional<Key>& key) {
  Intake intake(key, 1);
  intake.subscribe(channel::kCommand, Intake::kMaxFixedSize, Access::kAuthentic);
  Trailer trailer{Role::kExecutive, 2, 0};
  const auto send = [&](const char* channel, Packet packet) {
    ++trailer.counter;
    if (key) seal(*key, channel, trailer, packet);
    return testing::short_datagram(channel, packet);
  };
  if (key) {  // the sender is confirmed, and stays so: this clock stands still
    Packet packet;
    const Presence presence{1, {{1, intake.take_presence(0)->challenge}}};
    if (!encode(presence, packet)) std::abort();
    intake.take(send(channel::kPresence, packet), 2, 0);
  }
  constexpr std::size_t kBatch = 100;
  std::vector<testing::Bytes> datagrams(kBatch);
  std::size_t next = kBatch;
  std::int64_t arrived = 0;
  for (auto _ : state) {
    if (next == kBatch) {
      state.PauseTiming();
      for (auto& datagram : datagrams) {
        datagram = send(channel::kCommand, Packet(static_cast<std::size_t>(kCommandSize)));
      }
      next = 0;
      state.ResumeTiming();
    }
    intake.take(datagrams[next++], 2, 0);
    arrived += intake.queue().pop() ? 1 : 0;
  }
  if (arrived != state.iterations()) state.SkipWithError("a packet was not delivered");
}
void BM_ArrivalWithoutKey(benchmark::State& state) { arrive(state, std::nullopt); }
BENCHMARK(BM_ArrivalWithoutKey);
void BM_ArrivalWithKey(benchmark::State& state) { arrive(state, new_key()); }
BENCHMARK(BM_ArrivalWithKey);

}  // namespace
