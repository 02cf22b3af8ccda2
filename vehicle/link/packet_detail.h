#pragma once
// Packs LCM's generated types and checks their layouts. Only for .cpp files of codecs.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/se3.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/packet_layout.h"

namespace dive::link::detail {

// Shared with the codecs of other modules.
using link::array;
using link::bytes;
using link::fits;
using link::max_size;
using link::Run;
using link::text;
using link::texts;

inline constexpr std::size_t kPoseSize = 7 * sizeof(double);

/// Checks a packed message too, so that every packet written can be read back. A text with a zero
/// byte is packed shorter than announced.
template <typename Message>
bool pack(const Message& message, std::span<const Run> layout, Packet& packet) {
  const int size = message.getEncodedSize();
  packet.resize(static_cast<std::size_t>(size));
  return message.encode(packet.data(), 0, size) == size && fits(layout, packet);
}

template <typename Message>
std::optional<Message> unpack(PacketView packet, std::span<const Run> layout) {
  if (!fits(layout, packet)) return std::nullopt;
  const int size = static_cast<int>(packet.size());
  Message message{};
  if (message.decode(packet.data(), 0, size) != size) return std::nullopt;
  return message;
}

/// LCM's boolean is a byte.
inline bool read_flag(std::int8_t byte, bool& flag) {
  flag = byte == 1;
  return byte == 0 || byte == 1;
}

/// `last` is the enumeration's last constant; the constants count from 0.
template <typename Enum>
bool read_enum(std::int8_t byte, Enum last, Enum& value) {
  if (byte < 0 || byte > static_cast<std::int8_t>(last)) return false;
  value = static_cast<Enum>(byte);
  return true;
}

inline void write_vector(const Eigen::Vector3d& vector, double (&out)[3]) {
  std::copy_n(vector.data(), 3, out);
}
inline Eigen::Vector3d read_vector(const double (&in)[3]) { return {in[0], in[1], in[2]}; }

/// In the order x y z w, as in Eigen; not normalised, so that every bit survives.
inline void write_quaternion(const Eigen::Quaterniond& q, double (&out)[4]) {
  std::copy_n(q.coeffs().data(), 4, out);
}
inline Eigen::Quaterniond read_quaternion(const double (&in)[4]) {
  return {in[3], in[0], in[1], in[2]};
}

template <typename PoseMessage>
void write_pose(const Pose& pose, PoseMessage& out) {
  write_vector(pose.p, out.p);
  write_quaternion(pose.q, out.q);
}
template <typename PoseMessage>
Pose read_pose(const PoseMessage& in) {
  return {read_vector(in.p), read_quaternion(in.q)};
}

template <typename PoseMessage>
void write_poses(const std::vector<Pose>& poses, std::int32_t& count,
                 std::vector<PoseMessage>& out) {
  count = static_cast<std::int32_t>(poses.size());
  out.resize(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) write_pose(poses[i], out[i]);
}
template <typename PoseMessage>
void read_poses(const std::vector<PoseMessage>& in, std::vector<Pose>& poses) {
  poses.clear();
  poses.reserve(in.size());
  for (const PoseMessage& pose : in) poses.push_back(read_pose(pose));
}

}  // namespace dive::link::detail
