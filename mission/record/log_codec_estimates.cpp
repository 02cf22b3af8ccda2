// Estimator outputs. Structured bindings unpack all members, so that a new member does not compile
// until it is logged.

#include <dive/state_estimate_t.hpp>
#include <dive/vision_estimate_t.hpp>

#include "mission/record/log_codec.h"
#include "mission/record/log_layouts.h"
#include "vehicle/link/packet_detail.h"

namespace dive::mission {

using namespace link::detail;

namespace {

void write_estimate(const estimation::StateEstimate& estimate, state_estimate_t& m) {
  const auto& [utime, valid, source, X_WB, v_WB_B, omega_WB_B, covariance, map_from_odom] =
      estimate;
  m.utime = utime;
  m.valid = valid ? 1 : 0;
  m.source = static_cast<std::int8_t>(source);
  write_pose(X_WB, m.pose);
  write_vector(v_WB_B, m.v);
  write_vector(omega_WB_B, m.omega);
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(m.covariance) = covariance;
  m.map_from_odom[0] = map_from_odom.yaw;
  m.map_from_odom[1] = map_from_odom.translation.x();
  m.map_from_odom[2] = map_from_odom.translation.y();
}

bool read_estimate(const state_estimate_t& m, estimation::StateEstimate& estimate) {
  estimate.utime = m.utime;
  estimate.X_WB = read_pose(m.pose);
  estimate.v_WB_B = read_vector(m.v);
  estimate.omega_WB_B = read_vector(m.omega);
  estimate.covariance =
      Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(m.covariance);
  estimate.map_from_odom = {m.map_from_odom[0], {m.map_from_odom[1], m.map_from_odom[2]}};
  return read_flag(m.valid, estimate.valid) &&
         read_enum(m.source, estimation::kLastEstimatorKind, estimate.source);
}

}  // namespace

bool encode(const estimation::StateEstimate& estimate, Packet& packet) {
  state_estimate_t m;
  write_estimate(estimate, m);
  return pack(m, layout::kEstimate, packet);
}

bool decode(PacketView packet, estimation::StateEstimate& estimate) {
  const auto m = unpack<state_estimate_t>(packet, layout::kEstimate);
  return m && read_estimate(*m, estimate);
}

bool encode(Utime now, const estimation::VisionEstimate& vision, Packet& packet) {
  const auto& [frame_utime, estimate, init_utime, period, fault, tracked, stereo, used, loops,
               tag] = vision;
  const auto& [closed, seen, recognised, moved, turned] = loops;
  const auto& [id, result, correction] = tag;
  vision_estimate_t m;
  m.utime = now;
  m.frame_utime = frame_utime;
  m.init_utime = init_utime;
  m.period = period;
  m.fault = static_cast<std::int8_t>(fault);
  m.tracked = tracked;
  m.stereo = stereo;
  m.used = used;
  m.loops = closed;
  m.loop_first_observed = seen;
  m.loop_recognised = recognised;
  m.loop_correction = moved;
  m.loop_heading_correction = turned;
  m.tag = id;
  m.tag_result = static_cast<std::int8_t>(result);
  m.tag_correction = correction;
  write_estimate(estimate, m.estimate);
  return pack(m, layout::kVision, packet);
}

bool decode(PacketView packet, estimation::VisionEstimate& vision) {
  const auto m = unpack<vision_estimate_t>(packet, layout::kVision);
  if (!m) return false;
  vision.frame_utime = m->frame_utime;
  vision.init_utime = m->init_utime;
  vision.period_s = m->period;
  vision.tracked = m->tracked;
  vision.stereo = m->stereo;
  vision.used = m->used;
  vision.loops = {m->loops, m->loop_first_observed, m->loop_recognised, m->loop_correction,
                  m->loop_heading_correction};
  vision.tag.id = m->tag;
  vision.tag.correction_m = m->tag_correction;
  return read_enum(m->fault, estimation::kLastVisionFault, vision.fault) &&
         read_enum(m->tag_result, estimation::kLastTagResult, vision.tag.result) &&
         read_estimate(m->estimate, vision.estimate);
}

}  // namespace dive::mission
