#pragma once
// Packets to and from other processes over LCM (UDP multicast): every subscriber of a channel
// receives its packets, perhaps late, twice, out of order or not at all.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "vehicle/link/codec.h"

namespace dive::link {

/// Channels: sender and message type.
namespace channel {
inline constexpr const char* kAhrs = "DIVE_AHRS";               ///< Vehicle: imu_t
inline constexpr const char* kDepth = "DIVE_DEPTH";             ///< Vehicle: depth_t
inline constexpr const char* kHealth = "DIVE_HEALTH";           ///< Vehicle: health_t
inline constexpr const char* kImage = "DIVE_IMAGE";             ///< Vehicle: image_t
inline constexpr const char* kImu = "DIVE_IMU";                 ///< Vehicle, 200 Hz: imu_t
inline constexpr const char* kRange = "DIVE_RANGE";             ///< Vehicle: range_scan_t
inline constexpr const char* kSimTick = "DIVE_SIM_TICK";        ///< Simulated vehicle: sim_tick_t
inline constexpr const char* kTruth = "DIVE_SIM_TRUTH";         ///< Simulated vehicle: truth_t
inline constexpr const char* kCommand = "DIVE_COMMAND";         ///< vehicle_command_t
inline constexpr const char* kHeartbeat = "DIVE_HEARTBEAT";     ///< Executive: heartbeat_t
inline constexpr const char* kStatus = "DIVE_STATUS";           ///< Executive: status_t
inline constexpr const char* kEstimate = "DIVE_ESTIMATE";       ///< Executive: state_estimate_t
inline constexpr const char* kPath = "DIVE_PATH";               ///< Executive: path_t
inline constexpr const char* kPayload = "DIVE_PAYLOAD";         ///< Executive: action_t
inline constexpr const char* kRequest = "DIVE_OPERATOR";        ///< Topside: operator_request_t
inline constexpr const char* kAnswer = "DIVE_OPERATOR_ANSWER";  ///< Executive: operator_answer_t
}  // namespace channel

/// Loopback only: packets leave the machine only with a URL of a larger ttl.
inline constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";

/// Not thread-safe: one per thread.
class Bus {
 public:
  /// False if the packet does not belong to the channel.
  using Handler = std::function<bool(PacketView)>;

  /// Fails with a sentence if LCM rejects the URL or there is no network. `receive_bytes`: size of
  /// the system's receive buffer, unless the URL sets it; 0: the system's default.
  [[nodiscard]] static tl::expected<Bus, std::string> open(const std::string& url,
                                                           int receive_bytes = 0);
  Bus(Bus&&) noexcept;
  Bus& operator=(Bus&&) noexcept;
  ~Bus();

  /// `handler` gets every packet of the channel of at most `max_bytes`; larger ones are counted.
  /// Its exceptions leave through wait().
  void subscribe(const char* channel, std::size_t max_bytes, Handler handler);

  /// The same for decoded values.
  template <typename Value>
  void listen(const char* channel, std::function<void(const Value&)> handler,
              std::size_t max_bytes = kMaxFixedSize) {
    subscribe(channel, max_bytes, [handler = std::move(handler)](PacketView packet) {
      Value value;
      const bool is_one = decode(packet, value);
      if (is_one) handler(value);
      return is_one;
    });
  }

  /// False if the system did not accept the packet.
  bool publish(const char* channel, const Packet& packet);

  /// Delivers the packets that have arrived and those that arrive until `deadline` of `clock`;
  /// returns true early once `enough` does (called after every packet). Delivers at most
  /// kMaxPackets and about kMaxBytes of the backlog, so that a flood does not block the caller.
  bool wait(Clock& clock, Utime deadline, const std::function<bool()>& enough = nullptr);

  /// Packets that were too large for their channel, or did not belong to it.
  [[nodiscard]] std::int64_t malformed() const;

  static constexpr int kMaxPackets = 2000;
  static constexpr std::size_t kMaxBytes = 4U << 20U;
  static constexpr int kImageBuffer = 4 << 20;       ///< Bytes, for a few image pairs.
  static constexpr std::size_t kMaxFixedSize = 256;  ///< Largest packet without a list, bytes.

 private:
  struct Impl;
  explicit Bus(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::link
