// Header, inputs, truth and tick mark. Values are taken apart by structured bindings, so that a
// new member does not compile before it is logged.

#include <dive/header_t.hpp>
#include <dive/map_change_t.hpp>
#include <dive/operator_t.hpp>
#include <dive/plan_reply_t.hpp>
#include <dive/tick_t.hpp>

#include "mission/record/log_codec.h"
#include "vehicle/link/packet_detail.h"

namespace dive::mission {

using namespace link::detail;

namespace {

constexpr Run kHeader[] = {bytes(8 + sizeof(double)),
                           text(kMaxText),
                           text(kMaxText),
                           text(kMaxFileText),
                           text(kMaxText),
                           text(kMaxFileText),
                           text(kMaxMeshText),
                           text(kMaxFileText),
                           text(kMaxFileText),
                           text(kMaxText)};
constexpr Run kPlanReply[] = {bytes(8 + 8 + 1 + 4 + 2 * sizeof(double)), text(kMaxText),
                              array(kPoseSize, kMaxWaypoints)};
constexpr Run kOperator[] = {bytes(8 + 1)};
constexpr Run kMap[] = {bytes(8), array(kPoseSize + 3 * sizeof(double), kMaxSeen)};
constexpr Run kTick[] = {bytes(8 + 4 + 8)};

}  // namespace

bool encode(const LogHeader& header, Packet& packet) {
  const auto& [version, seed, mission_name, mission_xml, map_name, map_xml, map_meshes, urdf,
               resume, resume_gap_s, digest] = header;
  for (const std::string* file : {&mission_xml, &map_xml, &urdf, &resume}) {
    if (file->size() >= kMaxFileText) return false;  // Before LCM counts in int.
  }
  if (map_meshes.size() >= kMaxMeshText) return false;
  header_t m;
  m.seed = static_cast<std::int64_t>(seed);
  m.version = version;
  m.mission_name = mission_name;
  m.mission_xml = mission_xml;
  m.map_name = map_name;
  m.map_xml = map_xml;
  m.map_meshes = map_meshes;
  m.resume = resume;
  m.resume_gap = resume_gap_s.value_or(-1.0);
  m.vehicle_urdf = urdf;
  m.digest = digest;
  return pack(m, kHeader, packet);
}

bool decode(PacketView packet, LogHeader& header) {
  const auto m = unpack<header_t>(packet, kHeader);
  if (!m) return false;
  header = {m->version,      static_cast<std::uint64_t>(m->seed),
            m->mission_name, m->mission_xml,
            m->map_name,     m->map_xml,
            m->map_meshes,   m->vehicle_urdf,
            m->resume,       {},
            m->digest};
  if (m->resume_gap >= 0.0) header.resume_gap_s = m->resume_gap;
  return true;
}

bool encode(Utime now, const PlanReply& reply, Packet& packet) {
  const auto& [id, status, reason, waypoints, clearance, length, warm_starts] = reply;
  if (waypoints.size() > kMaxWaypoints) return false;
  plan_reply_t m;
  m.utime = now;
  m.id = id;
  m.status = static_cast<std::int8_t>(status);
  m.warm_starts = warm_starts;
  m.clearance = clearance;
  m.length = length;
  m.reason = reason;
  write_poses(waypoints, m.n, m.waypoints);
  return pack(m, kPlanReply, packet);
}

bool decode(PacketView packet, PlanReply& reply) {
  const auto m = unpack<plan_reply_t>(packet, kPlanReply);
  if (!m) return false;
  reply.id = m->id;
  reply.reason = m->reason;
  read_poses(m->waypoints, reply.waypoints);
  reply.clearance_m = m->clearance;
  reply.length_m = m->length;
  reply.warm_starts = m->warm_starts;
  return read_enum(m->status, planning::PlanStatus::kInvalid, reply.status);
}

bool encode(Utime now, OperatorCommand command, Packet& packet) {
  operator_t m;
  m.utime = now;
  m.command = static_cast<std::int8_t>(command);
  return pack(m, kOperator, packet);
}

bool decode(PacketView packet, OperatorCommand& command) {
  const auto m = unpack<operator_t>(packet, kOperator);
  return m && read_enum(m->command, OperatorCommand::kSkip, command);
}

bool encode(Utime now, const std::vector<SeenObstacle>& seen, Packet& packet) {
  if (seen.size() > kMaxSeen) return false;
  map_change_t m;
  m.utime = now;
  m.n = static_cast<std::int32_t>(seen.size());
  m.boxes.resize(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto& [X_WO, size] = seen[i];
    write_pose(X_WO, m.boxes[i].pose);
    write_vector(size, m.boxes[i].size);
  }
  return pack(m, kMap, packet);
}

bool decode(PacketView packet, std::vector<SeenObstacle>& seen) {
  const auto m = unpack<map_change_t>(packet, kMap);
  if (!m) return false;
  seen.clear();
  for (const box_t& box : m->boxes) seen.push_back({read_pose(box.pose), read_vector(box.size)});
  return true;
}

bool encode(const TickMark& mark, Packet& packet) {
  const auto& [utime, events, digest] = mark;
  tick_t m;
  m.utime = utime;
  m.events = events;
  m.digest = static_cast<std::int64_t>(digest);
  return pack(m, kTick, packet);
}

bool decode(PacketView packet, TickMark& mark) {
  const auto m = unpack<tick_t>(packet, kTick);
  if (!m) return false;
  mark = {m->utime, m->events, static_cast<std::uint64_t>(m->digest)};
  return true;
}

}  // namespace dive::mission
