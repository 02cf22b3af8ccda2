#include "behaviors/monitors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"
#include "vehicle/command_timing.h"
#include "vehicle/plausibility.h"

namespace dive::behaviors {
namespace {

constexpr double kMaxTurnRate = 35.0;        // rad/s: what the gyros of a vehicle can show
constexpr double kMaxAcceleration = 160.0;   // m/s^2
constexpr double kMinPlausibleDepth = -5.0;  // m of depth: waves, and drift of a barometer
constexpr double kNoticeable = 0.15;         // m: a change of depth that the sensor must show
constexpr double kLag = 1.0;                 // s within which it must show it
constexpr double kGoodHeight = 0.05;         // m, one sigma of a height by the map
constexpr double kRisen = 0.2;               // m of such a height that the depth must show
constexpr int kDenials = 2;                  // fixes in a row
constexpr double kMoved = 0.3;               // m: a distance that counts as motion
// The vehicle is meant to move if it is commanded this speed (m/s) or is this far from its
// commanded depth (m).
constexpr double kUnderWay = 0.1;
constexpr double kFarFromDepth = 0.5;
constexpr double kClimbing = 0.05;  // m/s: a vertical velocity expected from the efforts
constexpr double kLossLasts = 1.0;  // s after the last loss of log or journal
constexpr double kLegGrace = 30.0;  // s of delay allowed to a short leg

}  // namespace

bool is_plausible(const ImuSample& sample) {
  return vehicle::is_attitude(sample.q_WB) && sample.gyro_B.allFinite() &&
         sample.gyro_B.cwiseAbs().maxCoeff() <= kMaxTurnRate && sample.accel_B.allFinite() &&
         sample.accel_B.cwiseAbs().maxCoeff() <= kMaxAcceleration;
}

bool is_plausible(const DepthSample& sample) {
  return sample.depth_m >= kMinPlausibleDepth &&
         sample.depth_m <= vehicle::kMaxPlausibleDepth;  // false for NaN
}

bool is_plausible(const HealthSample& sample) {
  return sample.battery_fraction >= 0.0 && sample.battery_fraction <= 1.1 &&
         sample.temperature_c >= -40.0 && sample.temperature_c <= 200.0;
}

Monitors::Monitors(MonitorLimits limits) : limits_(std::move(limits)) {
  DIVE_DEMAND(limits_.fence.empty() || limits_.fence.size() >= 3);
}

void Monitors::start(Utime now) { started_ = last_update_ = now; }

// A time between two ticks in which a command becomes stale is a stall of the executive, which
// could neither receive nor command: it is no silence of the sensors, and no time without progress.
void Monitors::leave_out_stall(Utime now) {
  const Utime stall = now - last_update_ - vehicle::kCommandStale;
  if (stall <= 0) return;
  const auto shift = [&](Utime& time) { time = std::min(time + stall, now); };
  shift(started_);
  shift(anchored_);
  if (scanned_) shift(*scanned_);
  for (Source* source : {&imu_, &depth_, &power_}) {
    shift(source->changed);
    if (source->arrived) shift(*source->arrived);
  }
  last_update_ += stall;
}

bool Monitors::note(Source& source, Utime now, Utime sampled, bool plausible, bool same) {
  if (!plausible || (source.arrived && sampled < source.sampled)) return false;
  if (!source.arrived || !same) source.changed = now;
  source.arrived = now;
  source.sampled = sampled;
  return true;
}

bool Monitors::accept(Utime now, const ImuSample& sample) {
  const bool plausible = is_plausible(sample);
  const bool same = plausible && sample.q_WB.coeffs() == last_q_;
  if (!note(imu_, now, sample.utime, plausible, same)) return false;
  last_q_ = sample.q_WB.coeffs();
  return true;
}

bool Monitors::accept(Utime now, const DepthSample& sample) {
  const bool plausible = is_plausible(sample);
  if (!note(depth_, now, sample.utime, plausible, sample.depth_m == last_depth_m_)) return false;
  last_depth_m_ = sample.depth_m;
  return true;
}

bool Monitors::accept(Utime now, const HealthSample& sample) {
  if (!note(power_, now, sample.utime, is_plausible(sample), false)) return false;
  health_ = sample;
  return true;
}

void Monitors::receive(const MapFix& fix) {
  if (fix.problem != MapFixProblem::kNoScan) receive_scan(fix.scan_utime);
  map_evidence_.add(fix.scan_utime, fix.agreement);
  compare_height(fix);
}

// Since the depth last changed. Its difference from the height by the map is the tide's, or an
// error of the map.
void Monitors::compare_height(const MapFix& fix) {
  const bool has_height = fix.height_sigma_m > 0.0 && fix.height_sigma_m < kGoodHeight;
  if (!has_height || !depth_.arrived) return;
  const double above = fix.height_W + last_depth_m_;
  if (fix.scan_utime <= depth_.changed + from_seconds(kLag)) {
    height_above_depth_ = above;
    height_denials_ = 0;
    return;
  }
  const bool denies = height_above_depth_ && std::abs(above - *height_above_depth_) > kRisen;
  height_denials_ = denies ? height_denials_ + 1 : 0;
}

bool Monitors::is_silent(const Source& source, Utime now, double after_s) const {
  return to_seconds(now - source.arrived.value_or(started_)) > after_s;
}

const FailsafeConditions& Monitors::update(const MonitorInput& input) {
  leave_out_stall(input.now);
  const bool wants_to_move = input.command.v > kUnderWay ||
                             std::abs(input.command.d + input.estimate->X_WB.p.z()) > kFarFromDepth;
  const Utime tick = input.now - last_update_;
  if (!wants_to_move) {  // at rest a working sensor may repeat its value: that time does not count
    if (!is_true(FailsafeKind::kImuLost)) imu_.changed = std::min(imu_.changed + tick, input.now);
    // Without attitude a missed failure is worse than a false alarm. Flippers that keep pushing
    // over the last metres are not at rest.
    const bool pushes = std::abs(input.expected_climb) > kClimbing;
    if (!pushes && !is_true(FailsafeKind::kDepthLost) && !is_true(FailsafeKind::kImuLost)) {
      depth_.changed = std::min(depth_.changed + tick, input.now);
      expected_rise_m_ = 0.0;
    }
    anchor_W_.reset();
  }
  watch_sensors(input);
  watch_estimate(input);
  watch_progress(input);
  set(FailsafeKind::kPlannerFailure,
      input.out_of_replans || input.plan_failures >= threshold(FailsafeKind::kPlannerFailure));
  set(FailsafeKind::kCommsLost,
      to_seconds(input.now - heartbeat_.value_or(started_)) > threshold(FailsafeKind::kCommsLost));
  set(FailsafeKind::kOperatorAbort, input.operator_abort);
  set(FailsafeKind::kLogLost, log_lost_ && to_seconds(input.now - *log_lost_) <= kLossLasts);
  set(FailsafeKind::kRetraceFailure, input.retrace_failed);
  return conditions_;
}

void Monitors::watch_sensors(const MonitorInput& input) {
  set(FailsafeKind::kLeak, health_.leak);
  set(FailsafeKind::kBattery, health_.battery_fraction < threshold(FailsafeKind::kBattery));
  set(FailsafeKind::kTemperature, health_.temperature_c > threshold(FailsafeKind::kTemperature));
  const auto same_for = [&](const Source& source) {
    return source.arrived ? to_seconds(input.now - source.changed) : 0.0;
  };
  const bool imu_is_silent = is_silent(imu_, input.now, threshold(FailsafeKind::kImuLost));
  set(FailsafeKind::kImuLost, imu_is_silent || same_for(imu_) > kFrozenSeconds);
  if (is_true(FailsafeKind::kImuLost)) {
    imu_loss_ = imu_is_silent ? SensorLoss::kSilent : SensorLoss::kFrozen;
  }
  // The vehicle should have risen or sunk, and the sensor does not show it.
  const Utime tick = input.now - std::exchange(last_update_, input.now);
  const double dt = to_seconds(tick);
  expected_rise_m_ = same_for(depth_) > 0.0 ? expected_rise_m_ + dt * input.expected_climb : 0.0;
  const bool has_moved = std::abs(expected_rise_m_) > kNoticeable || height_denials_ >= kDenials;
  const bool ought_to_change = has_moved && same_for(depth_) > kLag;
  const bool depth_is_silent = is_silent(depth_, input.now, threshold(FailsafeKind::kDepthLost));
  const bool depth_is_frozen = same_for(depth_) > kFrozenSeconds;
  set(FailsafeKind::kDepthLost, depth_is_silent || ought_to_change || depth_is_frozen);
  if (is_true(FailsafeKind::kDepthLost)) {
    depth_loss_ = depth_is_silent   ? SensorLoss::kSilent
                  : depth_is_frozen ? SensorLoss::kFrozen
                                    : SensorLoss::kContradicted;
  }
  set(FailsafeKind::kHealthLost,
      is_silent(power_, input.now, threshold(FailsafeKind::kHealthLost)));
  // Scans cannot be used without attitude: that time does not count.
  if (is_true(FailsafeKind::kImuLost)) {
    scanned_ = std::min(scanned_.value_or(started_) + tick, input.now);
  }
  set(FailsafeKind::kRangeLost, limits_.watches_range && !input.rises &&
                                    to_seconds(input.now - scanned_.value_or(started_)) >
                                        threshold(FailsafeKind::kRangeLost));
}

void Monitors::watch_estimate(const MonitorInput& input) {
  const estimation::StateEstimate& estimate = *input.estimate;
  const Eigen::Vector3d& p_W = estimate.X_WB.p;
  const double depth = -p_W.z();
  const bool has_depth = depth_.arrived && !is_true(FailsafeKind::kDepthLost);
  set(FailsafeKind::kOverdepth, (has_depth ? last_depth_m_ : depth) > limits_.max_depth);
  set(FailsafeKind::kMinAltitude, input.altitude_m && *input.altitude_m < limits_.min_altitude);
  set(FailsafeKind::kGeofence, is_outside_fence(p_W));
  const bool denies =
      has_depth && std::abs(depth - last_depth_m_) > threshold(FailsafeKind::kEstimatorDiverged);
  set(FailsafeKind::kEstimatorDiverged,
      !estimate.X_WB.is_finite() || !estimate.covariance.allFinite() || denies);
  set(FailsafeKind::kLocalisationLost,
      input.margin_sigma < threshold(FailsafeKind::kLocalisationLost));
  const MapEvidence::Sum evidence = map_evidence_.sum(input.now);
  map_agreement_ = evidence.places;
  set(FailsafeKind::kWrongMap, evidence.contradicts_map());
}

// The ray from p_W to the east crosses the edges of a fence an odd number of times from inside.
bool Monitors::is_outside_fence(const Eigen::Vector3d& p_W) const {
  if (limits_.fence.empty()) return false;
  bool outside = true;
  const std::size_t count = limits_.fence.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d& a = limits_.fence[i];
    const Eigen::Vector2d& b = limits_.fence[(i + 1) % count];
    if ((a.y() > p_W.y()) == (b.y() > p_W.y())) continue;
    const double x = a.x() + (p_W.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (p_W.x() < x) outside = !outside;
  }
  return outside;
}

void Monitors::watch_progress(const MonitorInput& input) {
  set(FailsafeKind::kMissionTimeout, input.elapsed_s > limits_.mission_timeout_s);
  set(FailsafeKind::kLegTimeout,
      input.leg_expected_s > 0.0 &&
          input.leg_elapsed_s >
              threshold(FailsafeKind::kLegTimeout) * input.leg_expected_s + kLegGrace);

  const Eigen::Vector3d& p_W = input.estimate->X_WB.p;
  if (!anchor_W_ || (p_W - *anchor_W_).norm() > kMoved) {
    anchor_W_ = p_W;
    anchored_ = input.now;
  }
  set(FailsafeKind::kStuck, to_seconds(input.now - anchored_) > threshold(FailsafeKind::kStuck));
}

}  // namespace dive::behaviors
