// Header, inputs, truth and tick mark. Structured bindings unpack all members, so that a new member
// does not compile until it is logged.

#include <dive/free_ahead_t.hpp>
#include <dive/header_t.hpp>
#include <dive/map_correction_t.hpp>
#include <dive/map_fix_t.hpp>
#include <dive/obstacle_ahead_t.hpp>
#include <dive/obstacle_update_t.hpp>
#include <dive/operator_t.hpp>
#include <dive/plan_reply_t.hpp>
#include <dive/pose_correction_t.hpp>
#include <dive/recording_loss_t.hpp>
#include <dive/tick_t.hpp>

#include "mission/record/log_codec.h"
#include "mission/record/log_layouts.h"
#include "vehicle/link/packet_detail.h"

namespace dive::mission {

using namespace link::detail;

namespace {

bool read_objects(const obstacle_update_t& m, std::vector<planning::ObjectChange>& objects) {
  objects.clear();
  for (std::size_t i = 0; i < m.first.size(); ++i) {
    planning::ObjectChange& object = objects.emplace_back();
    object = {m.first[i], m.count[i], false, m.scans[i], m.seen_share[i]};
    if (!read_flag(m.is_absent[i], object.is_absent)) return false;
  }
  return true;
}

}  // namespace

bool encode(const LogHeader& header, Packet& packet) {
  const auto& [version, mathematics, seed, mission_name, mission_xml, map_name, map_xml, map_meshes,
               urdf, resume, resume_gap_s, check] = header;
  for (const std::string* file : {&mission_xml, &map_xml, &urdf, &resume}) {
    if (file->size() >= kMaxFileText) return false;  // Checked before LCM counts in int.
  }
  if (map_meshes.size() >= kMaxMeshText) return false;
  header_t m;
  m.seed = static_cast<std::int64_t>(seed);
  m.version = version;
  m.mathematics = mathematics;
  m.mission_name = mission_name;
  m.mission_xml = mission_xml;
  m.map_name = map_name;
  m.map_xml = map_xml;
  m.map_meshes = map_meshes;
  m.resume = resume;
  m.resume_gap = resume_gap_s.value_or(-1.0);
  m.vehicle_urdf = urdf;
  m.check = check;
  return pack(m, layout::kHeader, packet);
}

bool decode(PacketView packet, LogHeader& header) {
  const auto m = unpack<header_t>(packet, layout::kHeader);
  if (!m) return false;
  header = {m->version,
            m->mathematics,
            static_cast<std::uint64_t>(m->seed),
            m->mission_name,
            m->mission_xml,
            m->map_name,
            m->map_xml,
            m->map_meshes,
            m->vehicle_urdf,
            m->resume,
            {},
            m->check};
  if (m->resume_gap >= 0.0) header.resume_gap_s = m->resume_gap;
  return true;
}

bool encode(Utime now, const PlanReply& reply, Packet& packet) {
  const auto& [id, plan] = reply;
  const auto& [status, accepted, reason, reduced, waypoints, clearance, length, warm_starts] = plan;
  if (waypoints.size() > kMaxWaypoints) return false;
  plan_reply_t m;
  m.utime = now;
  m.id = id;
  m.status = static_cast<std::int8_t>(status);
  m.accepted = accepted ? 1 : 0;
  m.warm_starts = warm_starts;
  m.clearance = clearance;
  m.length = length;
  m.reason = reason;
  const auto& [narrow_length, place_W, obstacle] = reduced.value_or(planning::NarrowPart());
  m.is_reduced = reduced ? 1 : 0;
  m.narrow_length = narrow_length;
  write_vector(place_W, m.narrow_place);
  m.narrow_obstacle = obstacle;
  write_poses(waypoints, m.n, m.waypoints);
  return pack(m, layout::kPlanReply, packet);
}

bool decode(PacketView packet, PlanReply& reply) {
  const auto m = unpack<plan_reply_t>(packet, layout::kPlanReply);
  if (!m) return false;
  reply.id = m->id;
  planning::PlanResult& plan = reply.plan;
  plan.reason = m->reason;
  bool is_reduced = false;
  if (!read_flag(m->is_reduced, is_reduced)) return false;
  plan.reduced.reset();
  if (is_reduced) {
    plan.reduced = {m->narrow_length, read_vector(m->narrow_place), m->narrow_obstacle};
  }
  read_poses(m->waypoints, plan.waypoints);
  plan.clearance_m = m->clearance;
  plan.length_m = m->length;
  plan.warm_starts = m->warm_starts;
  return read_flag(m->accepted, plan.accepted) &&
         read_enum(m->status, planning::kLastPlanStatus, plan.status);
}

bool encode(Utime now, OperatorCommand command, Packet& packet) {
  operator_t m;
  m.utime = now;
  m.command = static_cast<std::int8_t>(command);
  return pack(m, layout::kOperator, packet);
}

bool decode(PacketView packet, OperatorCommand& command) {
  const auto m = unpack<operator_t>(packet, layout::kOperator);
  return m && read_enum(m->command, kLastOperatorCommand, command);
}

bool encode(Utime now, const planning::ObstacleUpdate& update, Packet& packet) {
  const auto& [source, utime, cells, objects] = update;
  if (objects.size() > planning::kMaxUpdateObjects) return false;
  obstacle_update_t m;
  m.utime = now;
  m.observed_utime = utime;
  m.source = static_cast<std::int8_t>(source);
  if (cells.size() > planning::kMaxUpdateCells) return false;
  for (const planning::MapCell& cell : cells) {
    const auto& [key, pieces] = cell;
    if (pieces.size() > planning::kMaxCellPieces) return false;
    m.keys.push_back(key);
    m.cell_pieces.push_back(static_cast<std::int32_t>(pieces.size()));
    for (const planning::Polytope& piece : pieces) {
      const auto& [vertices, radius] = piece;
      if (vertices.empty() || vertices.size() > planning::kMaxPieceVertices) return false;
      m.radii.push_back(radius);
      m.piece_vertices.push_back(static_cast<std::int32_t>(vertices.size()));
      for (const Eigen::Vector3d& v : vertices) {
        m.vertices.insert(m.vertices.end(), v.data(), v.data() + 3);
      }
    }
  }
  m.cells = static_cast<std::int32_t>(m.keys.size());
  m.pieces = static_cast<std::int32_t>(m.radii.size());
  m.num_values = static_cast<std::int32_t>(m.vertices.size());
  for (const planning::ObjectChange& object : objects) {
    const auto& [first, count, is_absent, scans, seen_share] = object;
    m.first.push_back(first);
    m.count.push_back(count);
    m.is_absent.push_back(is_absent ? 1 : 0);
    m.scans.push_back(scans);
    m.seen_share.push_back(seen_share);
  }
  m.objects = static_cast<std::int32_t>(objects.size());
  return pack(m, layout::kObstacles, packet);
}

bool decode(PacketView packet, planning::ObstacleUpdate& update) {
  const auto m = unpack<obstacle_update_t>(packet, layout::kObstacles);
  if (!m || !read_enum(m->source, planning::kLastObstacleSource, update.source)) return false;
  const auto is_count = [](std::int32_t value, std::size_t least, std::size_t most) {
    return value >= static_cast<std::int32_t>(least) && value <= static_cast<std::int32_t>(most);
  };
  update.utime = m->observed_utime;
  update.cells.clear();
  update.cells.reserve(m->keys.size());
  std::size_t piece = 0;
  std::size_t number = 0;
  for (std::size_t i = 0; i < m->keys.size(); ++i) {
    if (!is_count(m->cell_pieces[i], 0, planning::kMaxCellPieces)) return false;
    const auto pieces = static_cast<std::size_t>(m->cell_pieces[i]);
    if (pieces > m->radii.size() - piece) return false;
    planning::MapCell& cell = update.cells.emplace_back();
    cell.key = m->keys[i];
    cell.pieces.reserve(pieces);
    for (const std::size_t end = piece + pieces; piece < end; ++piece) {
      if (!is_count(m->piece_vertices[piece], 1, planning::kMaxPieceVertices)) return false;
      const auto vertices = static_cast<std::size_t>(m->piece_vertices[piece]);
      if (3 * vertices > m->vertices.size() - number) return false;
      planning::Polytope& polytope = cell.pieces.emplace_back();
      polytope.radius = m->radii[piece];
      polytope.vertices.reserve(vertices);
      for (std::size_t v = 0; v < vertices; ++v, number += 3) {
        polytope.vertices.emplace_back(&m->vertices[number]);
      }
    }
  }
  return piece == m->radii.size() && number == m->vertices.size() &&
         read_objects(*m, update.objects);
}

bool encode(Utime now, const planning::FreeAhead& free_ahead, Packet& packet) {
  const auto& [scan_utime, free_ahead_m] = free_ahead;
  free_ahead_t m;
  m.utime = now;
  m.scan_utime = scan_utime;
  m.free_ahead = free_ahead_m;
  return pack(m, layout::kFreeAhead, packet);
}

bool decode(PacketView packet, planning::FreeAhead& free_ahead) {
  const auto m = unpack<free_ahead_t>(packet, layout::kFreeAhead);
  if (!m) return false;
  free_ahead = {m->scan_utime, m->free_ahead};
  return true;
}

bool encode(Utime now, const planning::ObstacleAhead& obstacle, Packet& packet) {
  const auto& [scan_utime, time_s, p_B] = obstacle;
  obstacle_ahead_t m;
  m.utime = now;
  m.scan_utime = scan_utime;
  m.time = time_s;
  for (int i = 0; i < 3; ++i) m.position[i] = p_B[i];
  return pack(m, layout::kObstacleAhead, packet);
}

bool decode(PacketView packet, planning::ObstacleAhead& obstacle) {
  const auto m = unpack<obstacle_ahead_t>(packet, layout::kObstacleAhead);
  if (!m) return false;
  obstacle = {m->scan_utime, m->time, {m->position[0], m->position[1], m->position[2]}};
  return true;
}

bool encode(Utime now, const planning::PoseCorrection& correction, Packet& packet) {
  const auto& [scan_utime, correction_W] = correction;
  pose_correction_t m;
  m.utime = now;
  m.scan_utime = scan_utime;
  m.correction[0] = correction_W.x();
  m.correction[1] = correction_W.y();
  return pack(m, layout::kPoseCorrection, packet);
}

bool decode(PacketView packet, planning::PoseCorrection& correction) {
  const auto m = unpack<pose_correction_t>(packet, layout::kPoseCorrection);
  if (!m) return false;
  correction = {m->scan_utime, {m->correction[0], m->correction[1]}};
  return true;
}

bool encode(Utime now, const MapCorrection& correction, Packet& packet) {
  if (correction.nodes.size() > kMaxMapCorrectionNodes) return false;
  map_correction_t m;
  m.utime = now;
  m.count = static_cast<std::int32_t>(correction.nodes.size());
  for (const auto& [utime, by] : correction.nodes) {
    m.observed.push_back(utime);
    m.yaw.push_back(by.yaw);
    m.x.push_back(by.translation.x());
    m.y.push_back(by.translation.y());
  }
  return pack(m, layout::kMapCorrection, packet);
}

bool decode(PacketView packet, MapCorrection& correction) {
  const auto m = unpack<map_correction_t>(packet, layout::kMapCorrection);
  if (!m) return false;
  correction.nodes.clear();
  for (std::size_t i = 0; i < m->observed.size(); ++i) {
    correction.nodes.push_back({m->observed[i], {m->yaw[i], {m->x[i], m->y[i]}}});
  }
  return true;
}

bool encode(Utime now, const MapFix& fix, Packet& packet) {
  const auto& [scan_utime, problem, position_W, heading_correction, information, gradient, height_W,
               height_sigma_m, used, gated, ambiguity, agreement] = fix;
  map_fix_t m;
  m.utime = now;
  m.scan_utime = scan_utime;
  m.problem = static_cast<std::int8_t>(problem);
  m.position[0] = position_W.x();
  m.position[1] = position_W.y();
  m.heading_correction = heading_correction;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      m.information[row][column] = information(row, column);
    m.gradient[row] = gradient[row];
  }
  m.height = height_W;
  m.height_sigma = height_sigma_m;
  m.used = used;
  m.gated = gated;
  m.ambiguity = ambiguity;
  m.confirmed = agreement.confirmed;
  m.missing = agreement.missing;
  m.unmapped = agreement.unmapped;
  m.missing_object = agreement.missing_object;
  return pack(m, layout::kMapFix, packet);
}

bool decode(PacketView packet, MapFix& fix) {
  const auto m = unpack<map_fix_t>(packet, layout::kMapFix);
  fix = {};
  if (!m || !read_enum(m->problem, kLastMapFixProblem, fix.problem)) return false;
  fix.scan_utime = m->scan_utime;
  fix.position_W = {m->position[0], m->position[1]};
  fix.heading_correction = m->heading_correction;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      fix.information(row, column) = m->information[row][column];
    fix.gradient[row] = m->gradient[row];
  }
  fix.height_W = m->height;
  fix.height_sigma_m = m->height_sigma;
  fix.used = m->used;
  fix.gated = m->gated;
  fix.ambiguity = m->ambiguity;
  fix.agreement = {m->confirmed, m->missing, m->unmapped, m->missing_object};
  return true;
}

bool encode(Utime now, const RecordingLoss& loss, Packet& packet) {
  const auto& [ticks, commits, commands] = loss;
  recording_loss_t m;
  m.utime = now;
  m.ticks = ticks;
  m.commits = commits;
  m.commands = commands;
  return pack(m, layout::kLoss, packet);
}

bool decode(PacketView packet, RecordingLoss& loss) {
  const auto m = unpack<recording_loss_t>(packet, layout::kLoss);
  if (!m) return false;
  loss = {m->ticks, m->commits, m->commands};
  return true;
}

bool encode(const TickMark& mark, Packet& packet) {
  const auto& [utime, events] = mark;
  tick_t m;
  m.utime = utime;
  m.events = events;
  return pack(m, layout::kTick, packet);
}

bool decode(PacketView packet, TickMark& mark) {
  const auto m = unpack<tick_t>(packet, layout::kTick);
  if (!m) return false;
  mark = {m->utime, m->events};
  return true;
}

}  // namespace dive::mission
