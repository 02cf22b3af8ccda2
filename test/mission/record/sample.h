#pragma once
// Random ticks, and a list of every field of a tick with its name in reports.

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/random.h"
#include "mission/record/log.h"

namespace dive::mission::testing {

inline LogHeader sample_header() {
  return {.version = "0.1.0",
          .mathematics = "sleef-3.5.1/0123456789abcdef",
          .seed = 0xfedcba9876543210ULL,
          .mission_name = "window.xml",
          .mission_xml = "<mission>\n\tä & ü\n</mission>\n",
          .map_name = "window.sdf",
          .map_xml = "<sdf/>",
          .map_meshes = "",
          .vehicle_urdf = "<robot/>",
          .resume = "a journal\n",
          .resume_gap_s = 0.5,
          .check = "bundle 0123"};
}

// ---------------------------------------------------------------------------- every field

template <typename F>
void each(const std::string& name, Eigen::Vector3d& v, F f) {
  f(name + ".x", v.x());
  f(name + ".y", v.y());
  f(name + ".z", v.z());
}
template <typename F>
void each(const std::string& name, Eigen::Quaterniond& q, F f) {
  f(name + ".x", q.x());
  f(name + ".y", q.y());
  f(name + ".z", q.z());
  f(name + ".w", q.w());
}
template <typename F>
void each(const std::string& name, Pose& pose, F f) {
  each(name + ".p", pose.p, f);
  each(name + ".q", pose.q, f);
}

template <typename F>
void each_vision(estimation::VisionEstimate& vision, F f) {
  f("DIVE_IN_VISION.frame_utime", vision.frame_utime);
  f("DIVE_IN_VISION.init_utime", vision.init_utime);
  f("DIVE_IN_VISION.period_s", vision.period_s);
  f("DIVE_IN_VISION.fault", vision.fault);
  f("DIVE_IN_VISION.tracked", vision.tracked);
  f("DIVE_IN_VISION.stereo", vision.stereo);
  f("DIVE_IN_VISION.used", vision.used);
  f("DIVE_IN_VISION.loops", vision.loops.count);
  f("DIVE_IN_VISION.loop_first_observed", vision.loops.first_observed);
  f("DIVE_IN_VISION.loop_recognised", vision.loops.recognised);
  f("DIVE_IN_VISION.loop_correction", vision.loops.moved_m);
  f("DIVE_IN_VISION.loop_heading_correction", vision.loops.turned_rad);
  f("DIVE_IN_VISION.tag.id", vision.tag.id);
  f("DIVE_IN_VISION.tag.result", vision.tag.result);
  f("DIVE_IN_VISION.tag.correction_m", vision.tag.correction_m);
  f("DIVE_IN_VISION.utime", vision.estimate.utime);
  f("DIVE_IN_VISION.valid", vision.estimate.valid);
  f("DIVE_IN_VISION.source", vision.estimate.source);
  each("DIVE_IN_VISION.X_WB", vision.estimate.X_WB, f);
  each("DIVE_IN_VISION.v_WB_B", vision.estimate.v_WB_B, f);
  each("DIVE_IN_VISION.omega_WB_B", vision.estimate.omega_WB_B, f);
  for (double& value : vision.estimate.covariance.reshaped()) f("DIVE_IN_VISION.covariance", value);
}

template <typename F>
void each_input(StepInputs& in, F f) {
  f("now", in.now);
  if (in.imu) {
    f("DIVE_IN_AHRS.utime", in.imu->utime);
    each("DIVE_IN_AHRS.q_WB", in.imu->q_WB, f);
    each("DIVE_IN_AHRS.gyro_B", in.imu->gyro_B, f);
    each("DIVE_IN_AHRS.accel_B", in.imu->accel_B, f);
  }
  if (in.depth) {
    f("DIVE_IN_DEPTH.utime", in.depth->utime);
    f("DIVE_IN_DEPTH.depth_m", in.depth->depth_m);
  }
  if (in.health) {
    f("DIVE_IN_HEALTH.utime", in.health->utime);
    f("DIVE_IN_HEALTH.battery_fraction", in.health->battery_fraction);
    f("DIVE_IN_HEALTH.temperature_c", in.health->temperature_c);
    f("DIVE_IN_HEALTH.leak", in.health->leak);
  }
  if (in.plan) {
    f("DIVE_IN_PLAN.id", in.plan->id);
    f("DIVE_IN_PLAN.status", in.plan->plan.status);
    f("DIVE_IN_PLAN.accepted", in.plan->plan.accepted);
    f("DIVE_IN_PLAN.reason", in.plan->plan.reason);
    if (in.plan->plan.reduced) {
      f("DIVE_IN_PLAN.reduced.length_m", in.plan->plan.reduced->length_m);
      each("DIVE_IN_PLAN.reduced.place_W", in.plan->plan.reduced->place_W, f);
      f("DIVE_IN_PLAN.reduced.obstacle", in.plan->plan.reduced->obstacle);
    }
    for (Pose& waypoint : in.plan->plan.waypoints) each("DIVE_IN_PLAN.waypoints", waypoint, f);
    f("DIVE_IN_PLAN.clearance_m", in.plan->plan.clearance_m);
    f("DIVE_IN_PLAN.length_m", in.plan->plan.length_m);
    f("DIVE_IN_PLAN.warm_starts", in.plan->plan.warm_starts);
  }
  if (in.operator_command) f("DIVE_IN_OPERATOR.command", *in.operator_command);
  for (planning::ObstacleUpdate& update : in.obstacles) {
    f("DIVE_IN_OBSTACLES.source", update.source);
    f("DIVE_IN_OBSTACLES.utime", update.utime);
    for (planning::MapCell& cell : update.cells) {
      f("DIVE_IN_OBSTACLES.key", cell.key);
      for (planning::Polytope& piece : cell.pieces) {
        f("DIVE_IN_OBSTACLES.radius", piece.radius);
        for (Eigen::Vector3d& v : piece.vertices) each("DIVE_IN_OBSTACLES.vertex", v, f);
      }
    }
    for (planning::ObjectChange& object : update.objects) {
      f("DIVE_IN_OBSTACLES.first", object.first);
      f("DIVE_IN_OBSTACLES.count", object.count);
      f("DIVE_IN_OBSTACLES.is_absent", object.is_absent);
      f("DIVE_IN_OBSTACLES.scans", object.scans);
      f("DIVE_IN_OBSTACLES.seen_share", object.seen_share);
    }
  }
  if (in.free_ahead) {
    f("DIVE_IN_FREE_AHEAD.scan_utime", in.free_ahead->scan_utime);
    f("DIVE_IN_FREE_AHEAD.free_ahead_m", in.free_ahead->free_ahead_m);
  }
  if (in.obstacle_ahead) {
    f("DIVE_IN_OBSTACLE_AHEAD.scan_utime", in.obstacle_ahead->scan_utime);
    f("DIVE_IN_OBSTACLE_AHEAD.time_s", in.obstacle_ahead->time_s);
    each("DIVE_IN_OBSTACLE_AHEAD.p_B", in.obstacle_ahead->p_B, f);
  }
  if (in.pose_correction) {
    f("DIVE_IN_POSE_CORRECTION.scan_utime", in.pose_correction->scan_utime);
    f("DIVE_IN_POSE_CORRECTION.x", in.pose_correction->correction_W.x());
    f("DIVE_IN_POSE_CORRECTION.y", in.pose_correction->correction_W.y());
  }
  if (in.map_correction) {
    for (MapCorrection::Node& node : in.map_correction->nodes) {
      f("DIVE_IN_MAP_CORRECTION.observed", node.utime);
      f("DIVE_IN_MAP_CORRECTION.yaw", node.correction.yaw);
      f("DIVE_IN_MAP_CORRECTION.x", node.correction.translation.x());
      f("DIVE_IN_MAP_CORRECTION.y", node.correction.translation.y());
    }
  }
  if (in.map_fix) {
    MapFix& fix = *in.map_fix;
    f("DIVE_IN_MAP_FIX.scan_utime", fix.scan_utime);
    f("DIVE_IN_MAP_FIX.x", fix.position_W.x());
    f("DIVE_IN_MAP_FIX.y", fix.position_W.y());
    f("DIVE_IN_MAP_FIX.heading_correction", fix.heading_correction);
    for (double& value : fix.information.reshaped()) f("DIVE_IN_MAP_FIX.information", value);
    for (double& value : fix.gradient) f("DIVE_IN_MAP_FIX.gradient", value);
    f("DIVE_IN_MAP_FIX.height_W", fix.height_W);
    f("DIVE_IN_MAP_FIX.height_sigma_m", fix.height_sigma_m);
    f("DIVE_IN_MAP_FIX.ambiguity", fix.ambiguity);
    f("DIVE_IN_MAP_FIX.confirmed", fix.agreement.confirmed);
    f("DIVE_IN_MAP_FIX.missing", fix.agreement.missing);
    f("DIVE_IN_MAP_FIX.unmapped", fix.agreement.unmapped);
    f("DIVE_IN_MAP_FIX.missing_object", fix.agreement.missing_object);
  }
  if (in.vision) each_vision(*in.vision, f);
  if (in.loss) {
    f("DIVE_IN_LOSS.ticks", in.loss->ticks);
    f("DIVE_IN_LOSS.commits", in.loss->commits);
    f("DIVE_IN_LOSS.commands", in.loss->commands);
  }
}

template <typename F>
void each_output(StepOutputs& out, F f) {
  f("DIVE_OUT_COMMAND.v", out.command.v);
  f("DIVE_OUT_COMMAND.h", out.command.h);
  f("DIVE_OUT_COMMAND.d", out.command.d);
  each("DIVE_OUT_COMMAND.o", out.command.o, f);
  f("DIVE_OUT_RATES.surge", out.rates.surge);
  f("DIVE_OUT_RATES.heave", out.rates.heave);
  f("DIVE_OUT_RATES.roll", out.rates.roll);
  f("DIVE_OUT_RATES.pitch", out.rates.pitch);
  f("DIVE_OUT_RATES.yaw", out.rates.yaw);
  f("DIVE_OUT_ESTIMATE.utime", out.estimate.utime);
  f("DIVE_OUT_ESTIMATE.valid", out.estimate.valid);
  f("DIVE_OUT_ESTIMATE.source", out.estimate.source);
  each("DIVE_OUT_ESTIMATE.X_WB", out.estimate.X_WB, f);
  each("DIVE_OUT_ESTIMATE.v_WB_B", out.estimate.v_WB_B, f);
  each("DIVE_OUT_ESTIMATE.omega_WB_B", out.estimate.omega_WB_B, f);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      f(fmt::format("DIVE_OUT_ESTIMATE.covariance({},{})", row, column),
        out.estimate.covariance(row, column));
    }
  }
  f("DIVE_OUT_STATUS.state", out.status.state);
  f("DIVE_OUT_STATUS.goal", out.status.goal);
  f("DIVE_OUT_STATUS.distance_to_go_m", out.status.distance_to_go_m);
  f("DIVE_OUT_STATUS.time_to_go_s", out.status.time_to_go_s);
  f("DIVE_OUT_STATUS.depth_m", out.status.depth_m);
  f("DIVE_OUT_STATUS.clearance_m", out.status.clearance_m);
  f("DIVE_OUT_STATUS.cross_track_m", out.status.cross_track_m);
  f("DIVE_OUT_STATUS.margin_sigma", out.status.margin_sigma);
  f("DIVE_OUT_STATUS.segment", out.status.segment);
  f("DIVE_OUT_STATUS.rung", out.status.rung);
  f("DIVE_OUT_STATUS.finished", out.status.finished);
  if (out.plan_query) {
    planning::PlanRequest& request = out.plan_query->request;
    f("DIVE_OUT_PLAN_QUERY.id", out.plan_query->id);
    f("DIVE_OUT_PLAN_QUERY.state", out.plan_query->state);
    f("DIVE_OUT_PLAN_QUERY.cause", out.plan_query->cause);
    each("DIVE_OUT_PLAN_QUERY.start", request.start, f);
    each("DIVE_OUT_PLAN_QUERY.goal", request.goal, f);
    f("DIVE_OUT_PLAN_QUERY.goal_attitude_fixed", request.goal_attitude_fixed);
    f("DIVE_OUT_PLAN_QUERY.attitude", request.limits.attitude);
    f("DIVE_OUT_PLAN_QUERY.clearance", request.limits.clearance);
    f("DIVE_OUT_PLAN_QUERY.reduced_clearance", request.limits.reduced_clearance);
    f("DIVE_OUT_PLAN_QUERY.min_z", request.limits.min_z);
    f("DIVE_OUT_PLAN_QUERY.max_z", request.limits.max_z);
    f("DIVE_OUT_PLAN_QUERY.seed", request.seed);
    f("DIVE_OUT_PLAN_QUERY.min_altitude", request.limits.min_altitude);
    f("DIVE_OUT_PLAN_QUERY.goal_tolerance", request.limits.goal_tolerance);
    for (std::size_t i = 0; i < request.previous.size(); ++i) {
      each(fmt::format("DIVE_OUT_PLAN_QUERY.previous[{}]", i), request.previous[i], f);
    }
    for (std::size_t i = 0; i < request.trail.size(); ++i) {
      each(fmt::format("DIVE_OUT_PLAN_QUERY.trail[{}]", i), request.trail[i], f);
    }
  }
  for (std::size_t i = 0; i < out.transitions.size(); ++i) {
    TransitionRecord& t = out.transitions[i];
    const std::string name = fmt::format("DIVE_OUT_TRANSITION[{}]", i);
    f(name + ".from", t.from);
    f(name + ".to", t.to);
    f(name + ".event", t.event);
    f(name + ".cause", t.cause);
    f(name + ".guards", t.guards);
  }
  for (std::size_t i = 0; i < out.failsafes.size(); ++i) {
    FailsafeRecord& r = out.failsafes[i];
    const std::string name = fmt::format("DIVE_OUT_FAILSAFE[{}]", i);
    f(name + ".rung", r.rung);
    f(name + ".cause", r.cause);
    f(name + ".competing", r.competing);
    f(name + ".why", r.why);
  }
  for (std::size_t i = 0; i < out.actions.size(); ++i) {
    const std::string name = fmt::format("DIVE_OUT_ACTION[{}]", i);
    f(name + ".kind", out.actions[i].kind);
    f(name + ".text", out.actions[i].text);
    f(name + ".once", out.actions[i].once);
  }
}

template <typename F>
void each_field(LoggedTick& tick, F f) {
  each_input(tick.inputs, f);
  each_output(tick.outputs, f);
  if (tick.truth) {
    f("DIVE_TRUTH.utime", tick.truth->utime);
    each("DIVE_TRUTH.X_WB", tick.truth->X_WB, f);
    for (std::size_t i = 0; i < tick.truth->contacts.size(); ++i) {
      f(fmt::format("DIVE_TRUTH.contacts[{}]", i), tick.truth->contacts[i]);
    }
  }
}

/// All values of a tick, with every bit.
inline std::string bits(LoggedTick tick) {
  std::string text;
  each_field(tick, [&](const std::string& name, const auto& value) {
    using T = std::decay_t<decltype(value)>;
    if constexpr (std::is_same_v<T, double>) {
      text += fmt::format("{}={:x}\n", name, std::bit_cast<std::uint64_t>(value));
    } else if constexpr (std::is_enum_v<T>) {
      text += fmt::format("{}={}\n", name, static_cast<int>(value));
    } else {
      text += fmt::format("{}={}\n", name, value);
    }
  });
  return text;
}

// ---------------------------------------------------------------------------- random values

class SampleMaker {
 public:
  explicit SampleMaker(std::uint64_t seed) : random_(seed) {}

  LoggedTick tick(Utime now) {
    LoggedTick tick;
    if (chance()) tick.inputs.imu.emplace();
    if (chance()) tick.inputs.depth.emplace();
    if (chance()) tick.inputs.health.emplace();
    if (chance()) {
      planning::PlanResult& plan = tick.inputs.plan.emplace().plan;
      plan.waypoints.resize(below(4));
      if (chance()) plan.reduced.emplace();
    }
    if (chance()) {
      planning::PlanRequest& request = tick.outputs.plan_query.emplace().request;
      request.previous.resize(below(4));
      request.trail.resize(below(3));
    }
    tick.outputs.transitions.resize(below(3));
    tick.outputs.failsafes.resize(below(3));
    if (chance()) tick.inputs.operator_command.emplace();
    tick.inputs.obstacles.resize(below(3));
    for (planning::ObstacleUpdate& update : tick.inputs.obstacles) {
      update.cells.resize(below(3));
      update.objects.resize(below(3));
      for (planning::MapCell& cell : update.cells) {
        cell.pieces.resize(below(3));
        for (planning::Polytope& piece : cell.pieces) piece.vertices.resize(1 + below(4));
      }
    }
    if (chance()) tick.inputs.free_ahead.emplace();
    if (chance()) tick.inputs.obstacle_ahead.emplace();
    if (chance()) tick.inputs.loss.emplace();
    if (chance()) tick.inputs.pose_correction.emplace();
    if (chance()) {
      tick.inputs.map_correction.emplace().nodes.resize(1 + below(3));
    }
    if (chance()) tick.inputs.map_fix.emplace();
    if (chance()) tick.inputs.vision.emplace();
    tick.outputs.actions.resize(below(3));
    if (chance()) tick.truth.emplace().contacts.resize(below(3));
    each_field(tick, [this](const std::string&, auto& value) { fill(value); });
    tick.inputs.now = now;
    return tick;
  }
  std::uint64_t bits() { return random_.bits(); }
  std::size_t below(std::size_t limit) { return random_.bits() % limit; }
  bool chance() { return below(2) == 0; }

 private:
  void fill(double& value) {
    static constexpr double kOdd[] = {0.0,
                                      -0.0,
                                      std::numeric_limits<double>::infinity(),
                                      std::numeric_limits<double>::quiet_NaN(),
                                      std::numeric_limits<double>::denorm_min(),
                                      -1e308};
    value = below(4) == 0 ? kOdd[below(std::size(kOdd))] : random_.normal();
  }
  void fill(std::int64_t& value) { value = static_cast<std::int64_t>(random_.bits()); }
  void fill(std::uint64_t& value) { value = random_.bits(); }
  void fill(int& value) { value = static_cast<int>(random_.bits()); }
  void fill(bool& value) { value = chance(); }
  void fill(std::string& value) {
    value.resize(below(3) == 0 ? 0 : below(40));
    for (char& c : value) c = static_cast<char>(1 + below(255));
  }
  void fill(OperatorCommand& value) { value = static_cast<OperatorCommand>(below(5)); }
  void fill(ActionRecord::Kind& value) { value = static_cast<ActionRecord::Kind>(below(3)); }
  void fill(planning::ObstacleSource& value) {
    value = static_cast<planning::ObstacleSource>(below(planning::kObstacleSources));
  }
  void fill(planning::PlanStatus& value) { value = static_cast<planning::PlanStatus>(below(4)); }
  void fill(planning::AttitudeMode& value) {
    value = static_cast<planning::AttitudeMode>(below(2));
  }
  void fill(estimation::VisionFault& value) {
    value = static_cast<estimation::VisionFault>(below(13));
  }
  void fill(estimation::TagResult& value) { value = static_cast<estimation::TagResult>(below(7)); }
  void fill(estimation::EstimatorKind& value) {
    value = static_cast<estimation::EstimatorKind>(below(2));
  }

  Random random_;
};

inline std::vector<LoggedTick> sample_ticks(std::uint64_t seed, int count) {
  SampleMaker maker(seed);
  std::vector<LoggedTick> ticks;
  for (int i = 0; i < count; ++i) ticks.push_back(maker.tick(20'000 * i));
  return ticks;
}

}  // namespace dive::mission::testing
