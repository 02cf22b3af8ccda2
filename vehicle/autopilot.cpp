#include "vehicle/autopilot.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"
#include "common/range_check.h"
#include "common/se3.h"

namespace dive::vehicle {
namespace {

constexpr double kJump = 2.0;  // m/s: a faster change of the depth command is a jump

double signed_square(double x) { return std::abs(x) * x; }

double effort(double x) { return std::clamp(x, -1.0, 1.0); }

}  // namespace

std::string AutopilotOptions::validate() const {
  RangeCheck check;
  for (int i = 0; i < 3; ++i) {
    check("attitude_p", attitude_p[i], 0.0, 100.0);
    check("attitude_d", attitude_d[i], 0.0, 100.0);
  }
  check("righting", righting.minCoeff(), 0.0, 1.0);
  check("righting", righting.maxCoeff(), 0.0, 1.0);
  check("max_turn_rate", max_turn_rate, 0.01, 10.0);
  check("depth_p", depth_p, 0.0, 100.0);
  check("depth_d", depth_d, 0.0, 100.0);
  check("depth_i", depth_i, 0.0, 100.0);
  check("depth_i_limit", depth_i_limit, 0.0, 1.0);
  check("depth_i_zone_m", depth_i_zone_m, 0.0, 10.0);
  check("depth_filter_s", depth_filter_s, 0.001, 10.0);
  check("heave_share", heave_share, 0.01, 1.0);
  check("full_heave", full_heave, 0.01, 5.0);
  check("heave_brake", heave_brake, 0.001, 10.0);
  check("heave_lift", heave_lift, 0.0, 100.0);
  check("heave_trim", heave_trim, 0.0, 100.0);
  check("give_way_s", give_way_s, 0.01, 60.0);
  check("nose_lift", nose_lift, 0.0, 1.5);
  check("hover_speed", hover_speed, 0.01, 5.0);
  check("full_speed", full_speed, 0.05, 5.0);
  check("coast_length_m", coast_length_m, 0.0, 100.0);
  check("speed_time_constant_s", speed_time_constant_s, 0.05, 60.0);
  return check.problem();
}

AutopilotOptions autopilot_options(const MotionModel& motion) {
  AutopilotOptions options;
  options.full_heave = motion.full_heave;
  options.heave_lift = motion.coast_m.z() / motion.tail_lift_m.y();
  options.full_speed = motion.full_speed;
  options.coast_length_m = motion.coast_m.x();
  options.speed_time_constant_s = motion.speed_time_constant_s;
  return options;
}

// The w with w^2 + heave_lift |u| w = |effort| full_heave^2.
double expected_heave(const AutopilotOptions& options, double effort, double speed) {
  const double half = 0.5 * options.heave_lift * std::abs(speed);
  const double push = std::abs(effort) * options.full_heave * options.full_heave;
  return std::copysign(std::sqrt(half * half + push) - half, effort);
}

Eigen::Vector3d righting_effort(const AutopilotOptions& options, const Eigen::Vector3d& up_B) {
  return {options.righting.x() * up_B.y(), -options.righting.y() * up_B.x(), 0.0};
}

Autopilot::Autopilot(const AutopilotOptions& options) : options_(options) {
  DIVE_DEMAND(options_.validate().empty());
}

PseudoRates Autopilot::step(const Command& command, const Eigen::Quaterniond& q_WB,
                            const Eigen::Vector3d& omega_B, double depth_m, double dt) {
  DIVE_DEMAND(dt > 0.0 && std::isfinite(depth_m) && q_WB.coeffs().allFinite());
  DIVE_DEMAND(std::isfinite(command.v) && std::isfinite(command.d));
  const Eigen::Vector3d up_B = q_WB.conjugate() * Eigen::Vector3d::UnitZ();
  const double surge = speed_effort(command.v + surge_for_depth_, dt);
  const double climb = speed_reference_ * up_B.x();  // m/s, from swimming along x alone
  const double pole = std::exp(-dt / options_.depth_filter_s);
  observe_depth(command.d, depth_m, pole, dt);
  track_depth(command.d, climb, 1.0 - pole, dt);
  const double heave = -depth_reference_rate_ - climb;  // m/s, the rest, for the flippers
  const double lift = lift_effort(heave, dt);

  Eigen::Vector3d error = so3_log(q_WB.conjugate() * command.o);
  error.z() += options_.nose_lift * lift * up_B.y();
  const Eigen::Vector3d turn = turn_effort(error, omega_B) + righting_effort(options_, up_B);
  // Munk moment: a flat hull that swims and heaves at once turns its face to the flow.
  const double trim = -(1.0 - given_way_) * options_.heave_trim * speed_reference_ * heave;
  give_way(turn.y() + trim, lift, dt);
  const double hovering = std::max(1.0 - std::abs(speed_reference_) / options_.hover_speed, 0.0);
  const double push = hovering * lift * up_B.x();
  // On its side nothing else can hold the depth, and the resulting motion is small.
  const double on_side = std::clamp(2.0 * std::abs(up_B.y()) - 1.0, 0.0, 1.0);
  surge_for_depth_ = on_side * push * speed_of_push();
  return {effort(surge + (1.0 - on_side) * push), (1.0 - given_way_) * effort(lift * up_B.z()),
          effort(turn.x()), effort(turn.y() + trim), effort(turn.z())};
}

Eigen::Vector3d Autopilot::turn_effort(const Eigen::Vector3d& error,
                                       const Eigen::Vector3d& omega_B) const {
  const Eigen::Vector3d most = options_.attitude_d * options_.max_turn_rate;
  const Eigen::Vector3d pull = options_.attitude_p.cwiseProduct(error);
  return pull.cwiseMax(-most).cwiseMin(most) - options_.attitude_d.cwiseProduct(omega_B);
}

// Until the flippers just balance what heave still asks of them.
void Autopilot::give_way(double pitch, double lift, double dt) {
  // Swimming ahead: the speed reference has the wrong sign while the vehicle brakes.
  const bool hinders = pitch * lift < 0.0;
  const double missing = hinders ? std::clamp(std::abs(pitch) - 1.0, -1.0, 1.0) : -1.0;
  given_way_ = std::clamp(given_way_ + missing * dt / options_.give_way_s, 0.0, 1.0);
}

double Autopilot::speed_effort(double speed, double dt) {
  const double full = options_.full_speed * options_.full_speed;
  const double drag = signed_square(speed_reference_);
  const double wanted = (speed - speed_reference_) / options_.speed_time_constant_s;
  const double result = effort((drag + options_.coast_length_m * wanted) / full);
  // The reference moves with the effort after saturation, so that it matches the vehicle.
  const double rate =
      options_.coast_length_m > 0.0 ? (result * full - drag) / options_.coast_length_m : wanted;
  speed_reference_ += rate * dt;
  return result;
}

// Step of the speed command, m/s, at which the speed loop gives full effort.
double Autopilot::speed_of_push() const {
  if (options_.coast_length_m == 0.0) return 0.0;
  return options_.full_speed * options_.full_speed * options_.speed_time_constant_s /
         options_.coast_length_m;
}

double Autopilot::heave_within_reach() const {
  return expected_heave(options_, options_.heave_share, speed_reference_);
}

// Estimates depth and its rate by a second-order observer, both poles at 1 / depth_filter_s: the
// difference of two noisy samples is too noisy for control.
void Autopilot::observe_depth(double commanded_depth, double depth_m, double pole, double dt) {
  if (!has_depth_) {
    has_depth_ = true;
    depth_ = depth_reference_ = depth_m;
    last_command_ = commanded_depth;
  }
  const double surprise = depth_m - (depth_ + depth_rate_ * dt);
  depth_ += depth_rate_ * dt + (1.0 - pole * pole) * surprise;
  depth_rate_ += (1.0 - pole) * (1.0 - pole) / dt * surprise;
}

// The reference approaches the command as fast as it can still brake, and moves along with a moving
// command: it follows a ramp without lag, and a jump without overshoot.
void Autopilot::track_depth(double commanded_depth, double climb, double gain, double dt) {
  const double command_rate = (commanded_depth - last_command_) / dt;
  last_command_ = commanded_depth;
  if (std::abs(command_rate) < kJump) commanded_rate_ += gain * (command_rate - commanded_rate_);

  const double gap = commanded_depth - depth_reference_;
  const double closing = std::min(std::sqrt(2.0 * options_.heave_brake * std::abs(gap)),
                                  std::abs(gap) / (2.0 * options_.depth_filter_s));
  const double up = heave_within_reach() + std::max(climb, 0.0);
  const double down = heave_within_reach() - std::min(climb, 0.0);
  const double rate = std::clamp(commanded_rate_ + std::copysign(closing, gap), -up, down);
  depth_reference_rate_ += gain * (rate - depth_reference_rate_);
  depth_reference_ += depth_reference_rate_ * dt;
}

double Autopilot::lift_effort(double heave, double dt) {
  const double error = depth_ - depth_reference_;  // positive: too deep
  const double drag =
      signed_square(heave) + options_.heave_lift * std::abs(speed_reference_) * heave;
  const double proportional = options_.depth_p * error +
                              options_.depth_d * (depth_rate_ - depth_reference_rate_) +
                              drag / (options_.full_heave * options_.full_heave);
  const double result = proportional + depth_integral_;
  if (std::abs(error) < options_.depth_i_zone_m && std::abs(result) < 1.0) {
    depth_integral_ = std::clamp(depth_integral_ + options_.depth_i * error * dt,
                                 -options_.depth_i_limit, options_.depth_i_limit);
  }
  return effort(result);
}

}  // namespace dive::vehicle
