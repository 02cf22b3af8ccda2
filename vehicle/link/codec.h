#pragma once
// The values exchanged by vehicle, executive, supervisor and topside, encoded as LCM packets
// (vehicle/messages/*.lcm) and decoded again. LCM's types stay internal.
//
// encode() replaces the content of `packet` and returns false if the value cannot be represented.
// decode() returns false for anything that encode() cannot produce: it neither throws nor allocates
// more than a few times the packet's size. Numbers keep every bit: the receiver checks whether a
// value makes sense, except for what makes a list of points valid.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/measurements.h"
#include "common/operator_command.h"
#include "common/range_scan.h"
#include "common/se3.h"
#include "vehicle/command.h"
#include "vehicle/exit_guidance.h"
#include "vehicle/exit_path.h"

namespace dive::link {

using Packet = std::vector<std::uint8_t>;
using PacketView = std::span<const std::uint8_t>;

inline constexpr std::size_t kMaxPathLength = 16'384;  ///< Maximum number of waypoints.
inline constexpr int kMaxImageSide = 4096;             ///< Maximum width and height, pixels.
inline constexpr int kCameras = 3;
inline constexpr float kMaxReach = 1000.0F;  ///< Largest range of a range sensor, m.

enum class Source { kExecutive, kSupervisor };
inline constexpr Source kLastSource = Source::kSupervisor;
enum class Mode { kRates, kDepthAndAngles };

/// See vehicle_command_t.lcm.
struct VehicleCommand {
  Utime utime = 0;
  std::int64_t sequence = 0;
  Source source = Source::kExecutive;
  Mode mode = Mode::kRates;
  vehicle::Command command;
  vehicle::PseudoRates rates;
  std::uint64_t session_id = 0;
  vehicle::ExitPhase phase = vehicle::ExitPhase::kIdle;  ///< Of the supervisor.
};

/// See exit_path_t.lcm.
struct ExitPathMessage {
  std::uint64_t session_id = 0;
  vehicle::ExitPath path;
  std::uint64_t map_digest = 0;  ///< Of the executive's known map; 0: none.
};

/// See truth_t.lcm.
struct Truth {
  Utime utime = 0;
  Pose X_WB;
  std::vector<std::string> contacts = {};
  double min_clearance_m = std::numeric_limits<double>::infinity();  ///< Since the dive began.
  std::string nearest = {};  ///< The obstacle at that clearance.
};

/// See sim_tick_t.lcm.
struct SimTick {
  Utime utime = 0;
  std::optional<Utime> ahrs;
  std::optional<Utime> depth;
  std::optional<Utime> health;
  std::optional<Utime> range;
  std::optional<Utime> left;
  std::optional<Utime> right;
  int imu_samples = 0;  ///< Number of IMU samples, 0 to 127.
  Utime last_imu = 0;   ///< Time of the last IMU sample; 0 without any.
};

/// Number of rejected operator requests, by reason.
struct Refusals {
  std::int32_t auth_failed = 0;
  std::int32_t replayed = 0;
  std::int32_t stale = 0;
  std::int32_t rate_limited = 0;  ///< Aborts without a code beyond the rate limit.
};

/// See heartbeat_t.lcm.
struct Heartbeat {
  Utime utime = 0;
  std::uint64_t session_id = 0;
  std::uint64_t challenge = 0;
  std::int64_t counter = 0;
  std::int64_t ticks = 0;
  Refusals refused;
  bool has_key = false;
  bool finished = false;
};

/// See operator_request_t.lcm.
struct OperatorRequest {
  std::uint64_t session_id = 0;
  std::int64_t counter = 0;
  std::uint64_t challenge = 0;
  OperatorCommand command = OperatorCommand::kHeartbeat;
};

enum class RequestResult { kAccepted, kAuthFailed, kReplayed, kStale, kNoKey };
inline constexpr RequestResult kLastRequestResult = RequestResult::kNoKey;

/// See operator_answer_t.lcm.
struct OperatorAnswer {
  std::uint64_t session_id = 0;
  std::int64_t counter = 0;
  OperatorCommand command = OperatorCommand::kHeartbeat;
  RequestResult result = RequestResult::kAccepted;
};

inline constexpr std::size_t kMaxEchoes = 32;  ///< Maximum number of echoes in a presence.

/// See presence_t.lcm.
struct Presence {
  struct Echo {
    std::uint64_t sender = 0;
    std::uint64_t challenge = 0;
  };
  std::uint64_t challenge = 0;
  std::vector<Echo> echoes;
};

/// See path_t.lcm.
struct Path {
  Utime utime = 0;
  double clearance_m = 0.0;
  std::vector<Pose> waypoints;
};

inline constexpr std::size_t kMaxContacts = 256;             ///< Maximum obstacles per packet.
inline constexpr std::size_t kMaxObstacleName = 64U << 10U;  ///< Maximum length, bytes.

/// Upper bound of the size of packets without a list, bytes.
inline constexpr std::size_t kMaxFixedPacket = 256;
// Sizes of the largest packets with a list, bytes; from their layouts.
extern const std::size_t kMaxExitPathPacket;
extern const std::size_t kMaxPresencePacket;
extern const std::size_t kMaxScanPacket;
extern const std::size_t kMaxTruthPacket;
/// Size of an image packet with `pixel_bytes` of pixels, bytes.
[[nodiscard]] std::size_t image_packet_size(std::size_t pixel_bytes);

[[nodiscard]] bool encode(const ImuSample& sample, Packet& packet);
[[nodiscard]] bool encode(const DepthSample& sample, Packet& packet);
[[nodiscard]] bool encode(const HealthSample& sample, Packet& packet);
[[nodiscard]] bool encode(const ImageFrame& frame, Packet& packet);
[[nodiscard]] bool encode(const RangeScan& scan, Packet& packet);
[[nodiscard]] bool encode(const VehicleCommand& command, Packet& packet);
[[nodiscard]] bool encode(const Truth& truth, Packet& packet);
[[nodiscard]] bool encode(const SimTick& tick, Packet& packet);
[[nodiscard]] bool encode(const Heartbeat& heartbeat, Packet& packet);
[[nodiscard]] bool encode(const OperatorRequest& request, Packet& packet);
[[nodiscard]] bool encode(const OperatorAnswer& answer, Packet& packet);
[[nodiscard]] bool encode(const Path& path, Packet& packet);
[[nodiscard]] bool encode(const Presence& presence, Packet& packet);
[[nodiscard]] bool encode(const ExitPathMessage& message, Packet& packet);
// Messages of the log only, stamped with the tick's time.
[[nodiscard]] bool encode(Utime now, const vehicle::Command& command, Packet& packet);
[[nodiscard]] bool encode(Utime now, const vehicle::PseudoRates& rates, Packet& packet);

[[nodiscard]] bool decode(PacketView packet, ImuSample& sample);
[[nodiscard]] bool decode(PacketView packet, DepthSample& sample);
[[nodiscard]] bool decode(PacketView packet, HealthSample& sample);
[[nodiscard]] bool decode(PacketView packet, ImageFrame& frame);
[[nodiscard]] bool decode(PacketView packet, RangeScan& scan);
[[nodiscard]] bool decode(PacketView packet, VehicleCommand& command);
[[nodiscard]] bool decode(PacketView packet, Truth& truth);
[[nodiscard]] bool decode(PacketView packet, SimTick& tick);
[[nodiscard]] bool decode(PacketView packet, Heartbeat& heartbeat);
[[nodiscard]] bool decode(PacketView packet, OperatorRequest& request);
[[nodiscard]] bool decode(PacketView packet, OperatorAnswer& answer);
[[nodiscard]] bool decode(PacketView packet, Path& path);
[[nodiscard]] bool decode(PacketView packet, Presence& presence);
[[nodiscard]] bool decode(PacketView packet, ExitPathMessage& message);
[[nodiscard]] bool decode(PacketView packet, vehicle::Command& command);
[[nodiscard]] bool decode(PacketView packet, vehicle::PseudoRates& rates);

}  // namespace dive::link
