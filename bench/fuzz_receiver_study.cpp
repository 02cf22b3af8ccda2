// Runs the libFuzzer target of fuzz_receiver.cpp without libFuzzer: on random datagrams, and on
// crafted ones, which are changed copies of real ones.

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "test/vehicle/link/datagrams.h"
#include "vehicle/link/channels.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using dive::link::testing::Bytes;

constexpr std::size_t kDatagrams = 100;  // in one input

Bytes noise(std::mt19937_64& random) {
  Bytes bytes(random() % 200);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

Bytes crafted(std::mt19937_64& random) {
  namespace testing = dive::link::testing;
  static const std::vector<Bytes> real = [] {
    std::vector<Bytes> all = testing::fragments(dive::link::channel::kRange, Bytes(900, 7), 300);
    all.push_back(testing::short_datagram(dive::link::channel::kDepth, Bytes(24)));
    all.push_back(testing::short_datagram(dive::link::channel::kRequest, Bytes(33)));
    all.push_back(testing::short_datagram(dive::link::channel::kPresence, Bytes(36)));
    all.push_back(testing::overflowing_datagram(dive::link::channel::kDepth));
    return all;
  }();
  Bytes bytes = real[random() % real.size()];
  for (std::uint64_t changes = random() % 4; changes > 0; --changes) {
    constexpr std::size_t kHeader = 36;
    bytes[random() % std::min(bytes.size(), kHeader)] =
        static_cast<std::uint8_t>(random() % 3 == 0 ? 0xFF : random());
  }
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Sends datagrams to the receiving end of the link.");
  std::int64_t random_count = 10'000'000;
  std::int64_t crafted_count = 100'000;
  unsigned seed = 1;
  app.add_option("--random", random_count, "Random datagrams");
  app.add_option("--crafted", crafted_count, "Crafted datagrams");
  app.add_option("--seed", seed, "Of both");
  CLI11_PARSE(app, argc, argv);
  std::mt19937_64 random(seed);
  for (std::int64_t left = random_count + crafted_count; left > 0;) {
    Bytes input;
    for (std::size_t i = 0; i < kDatagrams && left > 0; ++i, --left) {
      const Bytes datagram = left > crafted_count ? noise(random) : crafted(random);
      input.push_back(static_cast<std::uint8_t>(random()));
      input.push_back(static_cast<std::uint8_t>(datagram.size() >> 8U));
      input.push_back(static_cast<std::uint8_t>(datagram.size()));
      input.insert(input.end(), datagram.begin(), datagram.end());
    }
    LLVMFuzzerTestOneInput(input.data(), input.size());
  }
  fmt::print("{} random and {} crafted datagrams\n", random_count, crafted_count);
  return 0;
}
