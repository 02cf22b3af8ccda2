#include <dive/exit_path_t.hpp>

#include "vehicle/link/codec.h"
#include "vehicle/link/packet_detail.h"

namespace dive::link {

using namespace detail;

namespace {

constexpr Run kExitPath[] = {
    bytes(std::size_t{4} * 8 + kPoseSize + 8 * sizeof(double) + 1 + 3 * sizeof(double)),
    array(kPoseSize, vehicle::kMaxExitWaypoints)};

}  // namespace

constexpr std::size_t kMaxExitPathPacket = max_size(kExitPath);

bool encode(const ExitPathMessage& message, Packet& packet) {
  const auto& [session_id, path, map_digest] = message;
  const auto& [utime, revision, X_WB, position_sigma_m, v_B, heading_correction, speed_scale,
               current_W, open_above, hold_s, speed, clearance_m, waypoints] = path;
  if (waypoints.size() > vehicle::kMaxExitWaypoints) return false;
  exit_path_t m;
  m.utime = utime;
  m.session_id = static_cast<std::int64_t>(session_id);
  m.revision = revision;
  m.map_digest = static_cast<std::int64_t>(map_digest);
  write_pose(X_WB, m.X_WB);
  m.position_sigma = position_sigma_m;
  write_vector(v_B, m.v_B);
  m.heading_correction = heading_correction;
  m.speed_scale = speed_scale;
  m.current[0] = current_W.x();
  m.current[1] = current_W.y();
  m.open_above = open_above ? 1 : 0;
  m.hold_s = hold_s;
  m.speed = speed;
  m.clearance = clearance_m;
  write_poses(waypoints, m.n, m.waypoints);
  return pack(m, kExitPath, packet);
}

bool decode(PacketView packet, ExitPathMessage& message) {
  const auto m = unpack<exit_path_t>(packet, kExitPath);
  if (!m) return false;
  message.session_id = static_cast<std::uint64_t>(m->session_id);
  message.map_digest = static_cast<std::uint64_t>(m->map_digest);
  vehicle::ExitPath& path = message.path;
  path.utime = m->utime;
  path.revision = m->revision;
  path.X_WB = read_pose(m->X_WB);
  path.position_sigma_m = m->position_sigma;
  path.v_B = read_vector(m->v_B);
  path.heading_correction = m->heading_correction;
  path.speed_scale = m->speed_scale;
  path.current_W = {m->current[0], m->current[1]};
  path.hold_s = m->hold_s;
  path.speed = m->speed;
  path.clearance_m = m->clearance;
  read_poses(m->waypoints, path.waypoints);
  return read_flag(m->open_above, path.open_above);
}

}  // namespace dive::link
