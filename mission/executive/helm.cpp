#include "mission/executive/helm.h"

#include "common/assert.h"
#include "common/se3.h"

namespace dive::mission {
namespace {

constexpr double kTilted = 0.2;  // rad
constexpr double kSpin = 0.1;    // yaw effort: on an Aqua2 a turn takes about ten seconds

}  // namespace

double Helm::expected_heave(double speed) const {
  return vehicle::expected_heave(options_, rates_.heave - autopilot_.trim_effort(), speed);
}

void Helm::step(const vehicle::Command& command, const Heard& heard, double dt) {
  DIVE_DEMAND(heard.imu != nullptr && dt > 0.0);
  if (heard.hears_imu && heard.imu->utime != predicted_from_) {
    predicted_from_ = heard.imu->utime;
    reckoned_.start(heard.imu->q_WB, heard.imu->gyro_B);
    drift_stop_.reset();
  } else {
    reckoned_.advance(rates_, dt);
  }
  // A reference that differs from the speed, for instance after a sharp turn, would brake past
  // rest.
  if (command.v == 0.0 || !heard.hears_imu) autopilot_.begin_at(heard.surge);
  if (!heard.hears_imu) return steer_blindly(command, heard, dt);
  const auto steer = [&](const vehicle::Command& measured) {
    rates_ = autopilot_.step(measured, heard.imu->q_WB, heard.imu->gyro_B, heard.depth_m, dt);
  };
  if (heard.heading_correction == 0.0) return steer(command);
  vehicle::Command measured = command;
  measured.o = from_rpy(0.0, 0.0, -heard.heading_correction) * command.o;
  steer(measured);
}

// Stops and levels by the predicted attitude, then uses only controls that need no attitude: the
// depth loop, as if level, and a slow turn. A tilted vehicle that heaves moves sideways, and it is
// never quite level: while turning, it moves in a circle instead of away.
void Helm::steer_blindly(const vehicle::Command& command, const Heard& heard, double dt) {
  vehicle::Command level = command;
  level.v = 0.0;
  if (reckoned_.is_trusted()) {
    level.o = from_rpy(0.0, 0.0, drift_stop_.heading(reckoned_.q_WB(), heard.v_B));
    rates_ = autopilot_.step(level, reckoned_.q_WB(), reckoned_.omega_B(), heard.depth_m, dt);
    if (reckoned_.tilt() > kTilted) rates_.heave = 0.0;
  } else {
    level.o = Eigen::Quaterniond::Identity();
    rates_ = autopilot_.step(level, level.o, Eigen::Vector3d::Zero(), heard.depth_m, dt);
    rates_.yaw = kSpin;
    // Without attitude and depth: an uncontrolled vehicle rises slowly and pushes against nothing.
    if (!heard.hears_depth && command.d >= 0.0) rates_ = {};
  }
}

}  // namespace dive::mission
