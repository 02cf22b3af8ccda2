#include "behaviors/orbit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"

namespace dive::behaviors {
namespace {

constexpr double kHasStopped = 0.1;      // m/s over ground, along the bow: a current flows on
constexpr double kTurnAfter = 6.0;       // s after which it turns even if it drifts
constexpr double kFacing = 0.052;        // rad, 3 degrees: the bow points to the centre
constexpr double kAligned = 0.2;         // rad: the rest of the turn is made in motion
constexpr double kNoBearing = 0.05;      // m from the centre: no bearing
constexpr double kRangeSlack = 0.2;      // m of range error that is not corrected
constexpr double kRangeGain = 0.3;       // m/s per m
constexpr double kMaxRangeSpeed = 0.08;  // m/s: below the speed that counts as motion
constexpr double kDrift = 0.3;           // m beyond the capture radius at which it returns
constexpr int kMaxReturns = 3;           // to one station, which then gets what dwell it has had

double bearing(const Eigen::Vector2d& direction, double otherwise) {
  return direction.norm() < kNoBearing ? otherwise : std::atan2(direction.y(), direction.x());
}

}  // namespace

Orbit::Orbit(const LegSettings& settings, const OrbitCircle& circle, std::vector<LegGoal> stations,
             std::size_t first)
    : settings_(settings), circle_(circle), stations_(std::move(stations)), current_(first) {
  DIVE_DEMAND(first < stations_.size() && circle.radius > 0.0 && circle.centre_W.allFinite());
  settings_.seed += 1000 * first;
  begin_station();
}

void Orbit::begin_station() {
  faced_s_ = 0.0;
  returns_ = 0;
  begin_leg();
}

// Orbit dwells itself: a leg would keep the heading of its arrival.
void Orbit::begin_leg() {
  LegGoal goal = stations_[current_];
  goal.dwell_s = 0.0;
  leg_.emplace(settings_, std::move(goal));
  phase_ = Phase::kSwimming;
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
  const bool is_at_rest = std::abs(input.estimate->v_WB_B.x()) < kHasStopped;
  if (is_at_rest || to_seconds(input.now - stopping_since_) > kTurnAfter) {
    phase_ = Phase::kFacing;
  }
  return output;
}

BehaviorOutput Orbit::face(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  const LegGoal& station = stations_[current_];
  const double off_station_m = (station.position_W - X_WB.p).head<2>().norm();
  const bool has_drifted = off_station_m > station.capture_radius + kDrift;
  if (has_drifted && returns_ < kMaxReturns) {
    ++returns_;
    ++settings_.seed;
    begin_leg();
    return start_leg(input);
  }
  const Eigen::Vector2d to_centre = circle_.centre_W - X_WB.p.head<2>();
  const double yaw = bearing(to_centre, yaw_of(X_WB));
  BehaviorOutput output;
  output.command = station_command(yaw);
  const double dt = last_tick_ ? to_seconds(input.now - *last_tick_) : 0.0;
  last_tick_ = input.now;
  const bool faces = std::abs(wrap_angle(yaw - yaw_of(X_WB))) <= kFacing;
  if (faces) faced_s_ += dt;
  // With the bow to the centre, surge alone keeps the radius.
  const double excess = to_centre.norm() - circle_.radius;
  if (faces && std::abs(excess) > kRangeSlack) {
    output.command.v = std::clamp(kRangeGain * excess, -kMaxRangeSpeed, kMaxRangeSpeed);
  }
  const bool has_dwelt = faces && faced_s_ >= station.dwell_s;
  if (!has_dwelt && !has_drifted) return output;
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
    return start_leg(input);
  }
  BehaviorOutput output;
  output.command = station_command(yaw);
  return output;
}

BehaviorOutput Orbit::start_leg(const BehaviorInput& input) {
  BehaviorInput first = input;
  first.plan = nullptr;  // it answers a request of the previous leg
  return swim(first);
}

bool Orbit::skip() {
  if (current_ + 1 == stations_.size()) return false;
  ++current_;
  settings_.seed += 1000;  // each leg draws from its own seed
  begin_station();
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
