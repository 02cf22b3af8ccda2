#include "estimation/vision_gate.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/planar.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinPeriod = 0.005;  // s
constexpr double kMaxPeriod = 2.0;    // s

bool is_sane(const StateEstimate& estimate) {
  return estimate.X_WB.is_finite() && std::abs(estimate.X_WB.q.norm() - 1.0) < 0.01 &&
         estimate.v_WB_B.allFinite() && estimate.covariance.allFinite();
}

bool is_plausible(const StateEstimate& estimate, const OdometryState& odometry,
                  const VisionGateOptions& options) {
  const Eigen::Quaterniond& q_WB = estimate.X_WB.q;
  const Vector3d up_B = q_WB.conjugate() * Vector3d::UnitZ();
  const Vector3d measured_up_B = odometry.q_OB.conjugate() * Vector3d::UnitZ();
  const double tilt = std::atan2(up_B.cross(measured_up_B).norm(), up_B.dot(measured_up_B));
  const Vector2d expected_W = turned(turn_between(q_WB, odometry.q_OB)) * odometry.v_O;
  const Vector2d excess_W = (q_WB * estimate.v_WB_B).head<2>() - expected_W;
  const Matrix3d P = horizontal_covariance(estimate.covariance, up_B);
  return estimate.v_WB_B.norm() <= options.max_speed &&
         excess_W.norm() <= options.max_excess_speed && tilt <= deg_to_rad(options.max_tilt_deg) &&
         P.llt().info() == Eigen::Success;
}

}  // namespace

std::string VisionGateOptions::validate() const {
  RangeCheck check;
  check("max_bad_updates", max_bad_updates, 1, 100);
  check("max_silent_periods", max_silent_periods, 1.0, 100.0);
  check("min_good_updates", min_good_updates, 1, 100);
  check("max_good_updates", max_good_updates, min_good_updates, 1000);
  check("short_use_s", short_use_s, 0.0, 1000.0);
  check("max_age_s", max_age_s, 0.01, 4.0);
  check("max_speed", max_speed, 0.1, 20.0);
  check("max_excess_speed", max_excess_speed, 0.01, 20.0);
  check("max_tilt_deg", max_tilt_deg, 1.0, 90.0);
  return check.problem();
}

VisionGate::VisionGate(const VisionGateOptions& options)
    : options_(options), good_needed_(options.min_good_updates) {
  DIVE_DEMAND(options_.validate().empty());
}

VisionFault VisionGate::find_fault(Utime now, const VisionEstimate& vision,
                                   const std::optional<OdometryState>& odometry) const {
  if (vision.fault != VisionFault::kNone) return vision.fault;
  const StateEstimate& estimate = vision.estimate;
  if (!estimate.valid) return VisionFault::kStarting;
  if (last_image_ && vision.frame_utime <= *last_image_) return VisionFault::kBadImage;
  if (vision.frame_utime > now || estimate.utime > now) return VisionFault::kBadImage;
  if (to_seconds(now - vision.frame_utime) > options_.max_age_s) return VisionFault::kLate;
  if (!odometry) return VisionFault::kLate;
  const bool is_usable = is_sane(estimate) && is_plausible(estimate, *odometry, options_);
  return is_usable ? VisionFault::kNone : VisionFault::kImplausible;
}

VisionGate::Decision VisionGate::evaluate(Utime now, const VisionEstimate& vision,
                                          const std::optional<OdometryState>& odometry) {
  if (vision.period_s >= kMinPeriod && vision.period_s <= kMaxPeriod) period_s_ = vision.period_s;
  const VisionFault fault = find_fault(now, vision, odometry);
  if (fault != VisionFault::kNone) {
    good_ = 0;
    ++bad_;
    last_bad_ = fault;
    if (!uses_vision()) fault_ = fault;
    if (!uses_vision() || bad_ < options_.max_bad_updates) return Decision::kRejected;
    lose(now, fault);
    return Decision::kLost;
  }
  bad_ = 0;
  ++good_;
  last_image_ = vision.frame_utime;
  last_accepted_ = now;
  if (!uses_vision() && good_ < good_needed_) return Decision::kRejected;
  if (!uses_vision()) used_since_ = now;
  fault_ = VisionFault::kNone;
  return Decision::kAccepted;
}

bool VisionGate::times_out(Utime now) {
  const double command_timeout_s = to_seconds(now - last_accepted_);
  if (!uses_vision() || command_timeout_s <= options_.max_silent_periods * period_s_) return false;
  lose(now, bad_ > 0 ? last_bad_ : VisionFault::kNoImages);
  return true;
}

void VisionGate::lose(Utime now, VisionFault fault) {
  const bool was_short = to_seconds(now - *used_since_) < options_.short_use_s;
  good_needed_ =
      was_short ? std::min(2 * good_needed_, options_.max_good_updates) : options_.min_good_updates;
  good_ = 0;
  used_since_.reset();
  fault_ = fault;
}

}  // namespace dive::estimation
