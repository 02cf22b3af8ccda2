#pragma once
// Everything that an attacker without the key can send into a dive that LCM itself survives:
// forged packets of each kind, and recordings of real ones.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "test/vehicle/link/datagrams.h"
#include "vehicle/link/bus.h"
#include "vehicle/link/udpm_url.h"

namespace dive::mission::testing {

/// What is sent on a channel, byte for byte with its trailers.
class Recording;

class Attacker {
 public:
  /// Records from now on.
  explicit Attacker(const std::string& url);
  ~Attacker();
  Attacker(const Attacker&) = delete;
  Attacker& operator=(const Attacker&) = delete;

  /// Sends a forged packet of each kind, and up to 20 recorded ones of each channel.
  void attack();

 private:
  template <typename Value>
  void forge(const char* channel, const Value& value);

  link::testing::DatagramSender sender_;
  link::Bus bus_;
  link::Packet packet_;
  std::vector<std::unique_ptr<Recording>> recordings_;
};

}  // namespace dive::mission::testing
