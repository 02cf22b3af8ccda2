#pragma once
// Our values as LCM packets (vehicle/messages/*.lcm) and back. LCM's types stay behind it.
//
// encode() fills `packet` anew and is false when the value cannot be represented: a text longer
// than allowed or with a zero byte in it, more waypoints than allowed. decode() is false for
// anything that encode() would not have made of some value: it neither throws nor allocates more
// than a few times the packet's size. Doubles keep every bit.

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

inline constexpr std::size_t kMaxFileText = 16U << 20U;  ///< Of a file in the header, bytes.
inline constexpr std::size_t kMaxMeshText = 64U << 20U;  ///< Of the meshes' pieces.
inline constexpr std::size_t kMaxText = 64U << 10U;      ///< Of any other text, bytes.
inline constexpr std::size_t kMaxWaypoints = 16'384;
inline constexpr std::size_t kMaxSeen = 4096;  ///< Obstacles in one tick.
/// Of all pieces of a map update; what else bounds one is in planning/world/seen.h.
inline constexpr std::size_t kMaxSeenVertices =
    planning::kMaxUpdatePieces * planning::kMaxPieceVertices;

/// No packet of the channel is larger.
[[nodiscard]] std::size_t max_packet_size(Channel channel);

/// The end of a tick.
struct TickMark {
  Utime utime = 0;
  std::int32_t events = 0;   ///< Of the tick, without the mark.
  std::uint64_t digest = 0;  ///< Over channel and packet of all events of the log so far.
};

using link::Packet;
using link::PacketView;
// Samples, command and rates are coded as they travel to and from the vehicle.
using link::decode;
using link::encode;

// What carries its own time.
[[nodiscard]] bool encode(const LogHeader& header, Packet& packet);
[[nodiscard]] bool encode(const estimation::StateEstimate& estimate, Packet& packet);
[[nodiscard]] bool encode(const TickMark& mark, Packet& packet);
// What is stamped with the tick's time.
[[nodiscard]] bool encode(Utime now, const PlanReply& reply, Packet& packet);
[[nodiscard]] bool encode(Utime now, const Status& status, Packet& packet);
[[nodiscard]] bool encode(Utime now, const PlanQuery& query, Packet& packet);
[[nodiscard]] bool encode(Utime now, const TransitionRecord& transition, Packet& packet);
[[nodiscard]] bool encode(Utime now, const FailsafeRecord& failsafe, Packet& packet);
[[nodiscard]] bool encode(Utime now, const ActionRecord& action, Packet& packet);
[[nodiscard]] bool encode(Utime now, OperatorCommand command, Packet& packet);
[[nodiscard]] bool encode(Utime now, const std::vector<SeenObstacle>& seen, Packet& packet);
[[nodiscard]] bool encode(Utime now, const planning::MapUpdate& update, Packet& packet);
[[nodiscard]] bool encode(Utime now, const estimation::VisionEstimate& vision, Packet& packet);

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
[[nodiscard]] bool decode(PacketView packet, std::vector<SeenObstacle>& seen);
[[nodiscard]] bool decode(PacketView packet, planning::MapUpdate& update);
[[nodiscard]] bool decode(PacketView packet, estimation::VisionEstimate& vision);

}  // namespace dive::mission
