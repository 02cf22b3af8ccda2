#pragma once
// Converts our values to LCM packets (vehicle/messages/*.lcm) and back. LCM's types stay internal.
//
// encode() overwrites `packet` and returns false if the value cannot be represented: a text longer
// than allowed or with a zero byte in it, more waypoints than allowed. decode() returns false for
// every packet that encode() cannot produce: it neither throws nor allocates more than a few times
// the packet's size. Doubles keep every bit.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/clock.h"
#include "mission/executive/io.h"
#include "mission/record/log.h"
#include "mission/record/log_channels.h"
#include "vehicle/link/codec.h"

namespace dive::mission {

inline constexpr std::size_t kMaxFileText = 16U << 20U;  ///< File in the header, bytes.
inline constexpr std::size_t kMaxMeshText = 64U << 20U;  ///< Convex pieces of the meshes, bytes.
inline constexpr std::size_t kMaxText = 64U << 10U;      ///< Any other text, bytes.
inline constexpr std::size_t kMaxWaypoints = 16'384;
/// Vertices of all pieces of an obstacle update; planning/world/obstacle_update.h has the other
/// bounds.
inline constexpr std::size_t kMaxUpdateVertices =
    planning::kMaxUpdatePieces * planning::kMaxPieceVertices;

/// Upper bound of the packet size on the channel; packets of kTick, the last of a log, have exactly
/// this size.
[[nodiscard]] std::size_t max_packet_size(Channel channel);

/// The end of a tick.
struct TickMark {
  Utime utime = 0;
  std::int32_t events = 0;  ///< Events of the tick, without the mark.
};

using link::Packet;
using link::PacketView;
// Samples, command and rates have the same encoding as on the link.
using link::decode;
using link::encode;

// Values that carry their own time.
[[nodiscard]] bool encode(const LogHeader& header, Packet& packet);
[[nodiscard]] bool encode(const estimation::StateEstimate& estimate, Packet& packet);
[[nodiscard]] bool encode(const TickMark& mark, Packet& packet);
// Values stamped with the tick's time.
[[nodiscard]] bool encode(Utime now, const PlanReply& reply, Packet& packet);
[[nodiscard]] bool encode(Utime now, const Status& status, Packet& packet);
[[nodiscard]] bool encode(Utime now, const PlanQuery& query, Packet& packet);
[[nodiscard]] bool encode(Utime now, const TransitionRecord& transition, Packet& packet);
[[nodiscard]] bool encode(Utime now, const FailsafeRecord& failsafe, Packet& packet);
[[nodiscard]] bool encode(Utime now, const ActionRecord& action, Packet& packet);
[[nodiscard]] bool encode(Utime now, OperatorCommand command, Packet& packet);
[[nodiscard]] bool encode(Utime now, const planning::ObstacleUpdate& update, Packet& packet);
[[nodiscard]] bool encode(Utime now, const planning::FreeAhead& free_ahead, Packet& packet);
[[nodiscard]] bool encode(Utime now, const planning::ObstacleAhead& obstacle, Packet& packet);
[[nodiscard]] bool encode(Utime now, const planning::PoseCorrection& correction, Packet& packet);
[[nodiscard]] bool encode(Utime now, const MapCorrection& correction, Packet& packet);
[[nodiscard]] bool encode(Utime now, const MapFix& fix, Packet& packet);
[[nodiscard]] bool encode(Utime now, const estimation::VisionEstimate& vision, Packet& packet);
[[nodiscard]] bool encode(Utime now, const RecordingLoss& loss, Packet& packet);

[[nodiscard]] bool decode(PacketView packet, LogHeader& header);
[[nodiscard]] bool decode(PacketView packet, estimation::StateEstimate& estimate);
[[nodiscard]] bool decode(PacketView packet, TickMark& mark);
[[nodiscard]] bool decode(PacketView packet, PlanReply& reply);
[[nodiscard]] bool decode(PacketView packet, Status& status);
[[nodiscard]] bool decode(PacketView packet, PlanQuery& query);
[[nodiscard]] bool decode(PacketView packet, TransitionRecord& transition);
[[nodiscard]] bool decode(PacketView packet, FailsafeRecord& failsafe);
[[nodiscard]] bool decode(PacketView packet, ActionRecord& action);
[[nodiscard]] bool decode(PacketView packet, OperatorCommand& command);
[[nodiscard]] bool decode(PacketView packet, planning::ObstacleUpdate& update);
[[nodiscard]] bool decode(PacketView packet, planning::FreeAhead& free_ahead);
[[nodiscard]] bool decode(PacketView packet, planning::ObstacleAhead& obstacle);
[[nodiscard]] bool decode(PacketView packet, planning::PoseCorrection& correction);
[[nodiscard]] bool decode(PacketView packet, MapCorrection& correction);
[[nodiscard]] bool decode(PacketView packet, MapFix& fix);
[[nodiscard]] bool decode(PacketView packet, estimation::VisionEstimate& vision);
[[nodiscard]] bool decode(PacketView packet, RecordingLoss& loss);

}  // namespace dive::mission
