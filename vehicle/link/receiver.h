#pragma once
// The receiving end of a multicast group: a socket and a thread that reads it into an Intake. LCM's
// own receiver is not used: see doc/decisions/own-receiver.md.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <tl/expected.hpp>

#include "vehicle/link/intake.h"
#include "vehicle/link/udpm_url.h"

namespace dive::link {

class Receiver {
 public:
  /// Called on the thread of the receiver.
  using SendPresence = std::function<void(const Presence&)>;

  /// Joins the group. The error is a sentence.
  [[nodiscard]] static tl::expected<std::unique_ptr<Receiver>, std::string> open(const UdpmUrl& url,
                                                                                 Intake& intake,
                                                                                 SendPresence send);
  /// Ends the thread.
  ~Receiver();
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

 private:
  Receiver(int socket, int wake, bool local_only, Intake& intake, SendPresence send);

  void run();
  void read_datagrams();
  void send_presence();
  /// Milliseconds until the next presence is due; -1 without a key.
  [[nodiscard]] std::int64_t time_to_presence() const;
  [[nodiscard]] bool is_local(std::uint32_t address);

  int socket_;
  int wake_;
  bool local_only_;  ///< True if packets of other machines are ignored.
  Intake& intake_;
  SendPresence send_;
  std::vector<std::uint8_t> buffer_;
  std::vector<std::uint32_t> own_addresses_;
  Utime addresses_at_;
  std::atomic<bool> wanted_ = true;
  std::thread thread_;
};

}  // namespace dive::link
