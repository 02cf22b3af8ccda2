// Outputs. Structured bindings unpack all members, so that a new member does not compile until it
// is logged.

#include <dive/action_t.hpp>
#include <dive/failsafe_t.hpp>
#include <dive/plan_query_t.hpp>
#include <dive/status_t.hpp>
#include <dive/transition_t.hpp>

#include "mission/record/log_codec.h"
#include "mission/record/log_layouts.h"
#include "vehicle/link/packet_detail.h"

namespace dive::mission {

using namespace link::detail;

bool encode(Utime now, const Status& status, Packet& packet) {
  const auto& [state, goal, distance_to_go, time_to_go, depth, clearance, cross_track, margin,
               segment, rung, finished] = status;
  status_t m;
  m.utime = now;
  m.state = state;
  m.goal = goal;
  m.rung = rung;
  m.distance_to_go = distance_to_go;
  m.time_to_go = time_to_go;
  m.depth = depth;
  m.clearance = clearance;
  m.cross_track = cross_track;
  m.margin = margin;
  m.segment = segment;
  m.finished = finished ? 1 : 0;
  return pack(m, layout::kStatus, packet);
}

bool decode(PacketView packet, Status& status) {
  const auto m = unpack<status_t>(packet, layout::kStatus);
  if (!m) return false;
  status = {m->state,       m->goal,   m->distance_to_go, m->time_to_go, m->depth, m->clearance,
            m->cross_track, m->margin, m->segment,        m->rung,       false};
  return read_flag(m->finished, status.finished);
}

bool encode(Utime now, const PlanQuery& query, Packet& packet) {
  const auto& [id, state, cause, request] = query;
  const auto& [start, goal, goal_attitude_fixed, limits, seed, previous, trail] = request;
  const auto& [attitude, clearance, reduced_clearance, min_z, max_z, min_altitude, goal_tolerance] =
      limits;
  if (previous.size() > kMaxWaypoints || trail.size() > kMaxWaypoints) return false;
  plan_query_t m;
  m.utime = now;
  m.id = id;
  m.seed = static_cast<std::int64_t>(seed);
  write_pose(start, m.start);
  write_pose(goal, m.goal);
  m.goal_attitude_fixed = goal_attitude_fixed ? 1 : 0;
  m.attitude = static_cast<std::int8_t>(attitude);
  m.clearance = clearance;
  m.reduced_clearance = reduced_clearance;
  m.min_z = min_z;
  m.max_z = max_z;
  m.min_altitude = min_altitude;
  m.goal_tolerance = goal_tolerance;
  m.state = state;
  m.cause = cause;
  write_poses(previous, m.n, m.previous);
  write_poses(trail, m.trail_n, m.trail);
  return pack(m, layout::kPlanQuery, packet);
}

bool decode(PacketView packet, PlanQuery& query) {
  const auto m = unpack<plan_query_t>(packet, layout::kPlanQuery);
  if (!m) return false;
  query.id = m->id;
  query.state = m->state;
  query.cause = m->cause;
  planning::PlanRequest& request = query.request;
  planning::MotionLimits& limits = request.limits;
  request.start = read_pose(m->start);
  request.goal = read_pose(m->goal);
  limits.clearance = m->clearance;
  limits.reduced_clearance = m->reduced_clearance;
  limits.min_z = m->min_z;
  limits.max_z = m->max_z;
  limits.min_altitude = m->min_altitude;
  limits.goal_tolerance = m->goal_tolerance;
  request.seed = static_cast<std::uint64_t>(m->seed);
  read_poses(m->previous, request.previous);
  read_poses(m->trail, request.trail);
  return read_flag(m->goal_attitude_fixed, request.goal_attitude_fixed) &&
         read_enum(m->attitude, planning::kLastAttitudeMode, limits.attitude);
}

bool encode(Utime now, const TransitionRecord& transition, Packet& packet) {
  const auto& [from, to, event, cause, guards] = transition;
  transition_t m;
  m.utime = now;
  m.from = from;
  m.to = to;
  m.event = event;
  m.cause = cause;
  m.guards = guards;
  return pack(m, layout::kTransition, packet);
}

bool decode(PacketView packet, TransitionRecord& transition) {
  const auto m = unpack<transition_t>(packet, layout::kTransition);
  if (!m) return false;
  transition = {m->from, m->to, m->event, m->cause, m->guards};
  return true;
}

bool encode(Utime now, const FailsafeRecord& failsafe, Packet& packet) {
  const auto& [rung, cause, competing, why] = failsafe;
  failsafe_t m;
  m.utime = now;
  m.rung = rung;
  m.cause = cause;
  m.competing = competing;
  m.why = why;
  return pack(m, layout::kFailsafe, packet);
}

bool decode(PacketView packet, FailsafeRecord& failsafe) {
  const auto m = unpack<failsafe_t>(packet, layout::kFailsafe);
  if (!m) return false;
  failsafe = {m->rung, m->cause, m->competing, m->why};
  return true;
}

bool encode(Utime now, const ActionRecord& action, Packet& packet) {
  const auto& [kind, text, once] = action;
  action_t m;
  m.utime = now;
  m.kind = static_cast<std::int8_t>(kind);
  m.text = text;
  m.once = once ? 1 : 0;
  return pack(m, layout::kAction, packet);
}

bool decode(PacketView packet, ActionRecord& action) {
  const auto m = unpack<action_t>(packet, layout::kAction);
  if (!m) return false;
  action.text = m->text;
  return read_flag(m->once, action.once) &&
         read_enum(m->kind, ActionRecord::kLastKind, action.kind);
}

std::size_t max_packet_size(Channel channel) {
  switch (channel) {
    case Channel::kHeader:
      return max_size(layout::kHeader);
    case Channel::kPlan:
      return max_size(layout::kPlanReply);
    case Channel::kOperator:
      return max_size(layout::kOperator);
    case Channel::kObstacles:
      return max_size(layout::kObstacles);
    case Channel::kFreeAhead:
      return max_size(layout::kFreeAhead);
    case Channel::kObstacleAhead:
      return max_size(layout::kObstacleAhead);
    case Channel::kPoseCorrection:
      return max_size(layout::kPoseCorrection);
    case Channel::kMapCorrection:
      return max_size(layout::kMapCorrection);
    case Channel::kMapFix:
      return max_size(layout::kMapFix);
    case Channel::kVision:
      return max_size(layout::kVision);
    case Channel::kLoss:
      return max_size(layout::kLoss);
    case Channel::kEstimate:
      return max_size(layout::kEstimate);
    case Channel::kStatus:
      return max_size(layout::kStatus);
    case Channel::kPlanQuery:
      return max_size(layout::kPlanQuery);
    case Channel::kTransition:
      return max_size(layout::kTransition);
    case Channel::kFailsafe:
      return max_size(layout::kFailsafe);
    case Channel::kAction:
      return max_size(layout::kAction);
    case Channel::kTruth:
      return link::kMaxTruthPacket;
    case Channel::kTick:
      return max_size(layout::kTick);
    case Channel::kAhrs:
    case Channel::kDepth:
    case Channel::kHealth:
    case Channel::kCommand:
    case Channel::kRates:
      return link::kMaxFixedPacket;
  }
  return 0;
}

}  // namespace dive::mission
