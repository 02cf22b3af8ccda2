#include "behaviors/orbit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"

namespace dive::behaviors {
namespace {

constexpr double kHasStopped = 0.05;     // m/s over ground
constexpr double kTurnAfter = 6.0;       // s after which it turns even if it drifts
constexpr double kFacing = 0.052;        // rad, 3 degrees: the bow points to the centre
constexpr double kAligned = 0.2;         // rad: the rest of the turn is made in motion
constexpr double kNoBearing = 0.05;      // m from the centre: no bearing
constexpr double kRangeSlack = 0.2;      // m of range error that is not corrected
constexpr double kRangeGain = 0.3;       // m/s per m
constexpr double kMaxRangeSpeed = 0.08;  // m/s: below the speed that counts as motion

double bearing(const Eigen::Vector2d& direction, double otherwise) {
  return direction.norm() < kNoBearing ? otherwise : std::atan2(direction.y(), direction.x());
}

}  // namespace

Orbit::Orbit(const LegSettings& settings, const OrbitCircle& circle, std::vector<LegGoal> stations,
             std::size_t first)
    : settings_(settings), circle_(circle), stations_(std::move(stations)), current_(first) {
  DIVE_DEMAND(first < stations_.size() && circle.radius > 0.0 && circle.centre_W.allFinite());
  settings_.seed += 1000 * first;
  begin_leg();
}

// Orbit dwells itself: a leg would keep the heading of its arrival.
void Orbit::begin_leg() {
  LegGoal goal = stations_[current_];
  goal.dwell_s = 0.0;
  leg_.emplace(settings_, std::move(goal));
  phase_ = Phase::kSwimming;
  faced_s_ = 0.0;
  last_tick_.reset();
}

BehaviorOutput Orbit::step(const BehaviorInput& input) {
  switch (phase_) {
    case Phase::kSwimming:
      return swim(input);
    case Phase::kStopping:
      return stop(input);
    case Phase::kFacing:
      return face(input);
    case Phase::kDeparting:
      return depart(input);
  }
  DIVE_DEMAND(false);
}

BehaviorOutput Orbit::swim(const BehaviorInput& input) {
  BehaviorOutput output = leg_->step(input);
  if (!output.done) return output;
  phase_ = Phase::kStopping;
  stopping_since_ = input.now;
  arrival_yaw_ = yaw_of(input.estimate->X_WB);
  return stop(input);
}

BehaviorOutput Orbit::stop(const BehaviorInput& input) {
  BehaviorOutput output;
  output.command = station_command(arrival_yaw_);
  const bool is_at_rest = input.estimate->v_WB_B.head<2>().norm() < kHasStopped;
  if (is_at_rest || to_seconds(input.now - stopping_since_) > kTurnAfter) {
    phase_ = Phase::kFacing;
  }
  return output;
}

BehaviorOutput Orbit::face(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  const Eigen::Vector2d to_centre = circle_.centre_W - X_WB.p.head<2>();
  const double yaw = bearing(to_centre, yaw_of(X_WB));
  BehaviorOutput output;
  output.command = station_command(yaw);
  const double dt = last_tick_ ? to_seconds(input.now - *last_tick_) : 0.0;
  last_tick_ = input.now;
  if (std::abs(wrap_angle(yaw - yaw_of(X_WB))) > kFacing) return output;
  faced_s_ += dt;
  // With the bow to the centre, surge alone keeps the radius.
  const double excess = to_centre.norm() - circle_.radius;
  if (std::abs(excess) > kRangeSlack) {
    output.command.v = std::clamp(kRangeGain * excess, -kMaxRangeSpeed, kMaxRangeSpeed);
  }
  if (faced_s_ < stations_[current_].dwell_s) return output;
  output.done = current_ + 1 == stations_.size();
  if (!output.done) phase_ = Phase::kDeparting;
  return output;
}

BehaviorOutput Orbit::depart(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  const Eigen::Vector3d to_next = stations_[current_ + 1].position_W - X_WB.p;
  const double yaw = bearing(to_next.head<2>(), yaw_of(X_WB));
  if (std::abs(wrap_angle(yaw - yaw_of(X_WB))) <= kAligned) {
    DIVE_DEMAND(skip());
    BehaviorInput next = input;
    next.plan = nullptr;  // it answers a request of the previous leg
    return swim(next);
  }
  BehaviorOutput output;
  output.command = station_command(yaw);
  return output;
}

bool Orbit::skip() {
  if (current_ + 1 == stations_.size()) return false;
  ++current_;
  settings_.seed += 1000;  // each leg draws from its own seed
  begin_leg();
  return true;
}

bool Orbit::needs_free_ahead() const {
  return phase_ == Phase::kSwimming && !leg_->is_backing_off();
}

void Orbit::way_ahead(const Pose& X_WB, double seconds, std::vector<Pose>& way) const {
  if (phase_ != Phase::kSwimming) return way.clear();
  leg_->way_ahead(X_WB, seconds, way);
}

bool Orbit::request_alternative() {
  return phase_ == Phase::kSwimming && leg_->request_alternative();
}

vehicle::Command Orbit::station_command(double yaw) const {
  return station_keeping(-stations_[current_].position_W.z(), yaw);
}

}  // namespace dive::behaviors
