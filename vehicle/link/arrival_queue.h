#pragma once
// Packets that have arrived and wait for the thread that handles them. Thread-safe.
//
// Every sender has its own allowance, so that a flood from one does not shut out another: a number
// of packets for each subscription, and no more bytes than are left for the others.

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>

#include "common/clock.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/envelope.h"

namespace dive::link {

enum class Trust {
  kAuthentic,    ///< By the key, and fresh.
  kUnconfirmed,  ///< By the key, but perhaps a recording.
  kAnonymous,    ///< Without a valid code, or received without a key.
};

struct Sender {
  /// With a key its random number (0: anonymous); without one its network address and port.
  std::uint64_t id = 0;
  Role role = Role::kObserver;
  Trust trust = Trust::kAnonymous;
};

struct Arrival {
  std::size_t subscription = 0;
  Sender sender;
  Packet packet;
};

class ArrivalQueue {
 public:
  static constexpr std::size_t kMaxBytes = 6U
                                           << 20U;  ///< Of all, unless one packet alone is larger.
  static constexpr std::size_t kOverhead = 256;     ///< Counted for each packet, bytes.

  /// False if the sender's allowance is used up: `max_packets` of its packets may wait for the same
  /// subscription.
  [[nodiscard]] bool push(Arrival arrival, std::size_t max_packets);
  [[nodiscard]] std::optional<Arrival> pop();
  /// Waits until there is a packet, for at most `timeout` us of real time.
  void wait(Utime timeout);

 private:
  struct Usage {
    std::size_t bytes = 0;
    std::map<std::size_t, std::size_t> packets;  ///< By subscription.
  };

  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<Arrival> arrivals_;
  std::map<std::uint64_t, Usage> usage_;  ///< By sender, while it has packets here.
  std::size_t bytes_ = 0;
};

}  // namespace dive::link
