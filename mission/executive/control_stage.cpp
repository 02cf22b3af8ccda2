#include "mission/executive/control_stage.h"

#include "common/assert.h"
#include "common/se3.h"

namespace dive::mission {
namespace {

constexpr double kTilted = 0.2;  // rad
constexpr double kSpin = 0.1;    // yaw effort: on an Aqua2 a turn takes about ten seconds

}  // namespace

double ControlStage::expected_heave(double speed) const {
  return vehicle::expected_heave(options_, rates_.heave - autopilot_.trim_effort(), speed);
}

void ControlStage::step(const vehicle::Command& command, const ControlMeasurements& measured,
                        double dt) {
  DIVE_DEMAND(measured.imu != nullptr && dt > 0.0);
  if (measured.imu_is_fresh && measured.imu->utime != predicted_from_) {
    predicted_from_ = measured.imu->utime;
    predicted_attitude_.start(measured.imu->q_WB, measured.imu->gyro_B);
    drift_stop_.reset();
  } else {
    predicted_attitude_.advance(rates_, dt);
  }
  // A reference that differs from the speed, for instance after a sharp turn, would brake past
  // rest.
  if (command.v == 0.0 || !measured.imu_is_fresh) autopilot_.begin_at(measured.surge);
  if (!measured.imu_is_fresh) return steer_blindly(command, measured, dt);
  const auto steer = [&](const vehicle::Command& raw) {
    rates_ = autopilot_.step(raw, measured.imu->q_WB, measured.imu->gyro_B, measured.depth_m, dt);
  };
  if (measured.heading_correction == 0.0) return steer(command);
  vehicle::Command raw = command;
  raw.o = from_rpy(0.0, 0.0, -measured.heading_correction) * command.o;
  steer(raw);
}

// Stops and levels by the predicted attitude, then uses only controls that need no attitude: the
// depth loop, as if level, and a slow turn. A tilted vehicle that heaves moves sideways, and it is
// never quite level: while turning, it moves in a circle instead of away.
void ControlStage::steer_blindly(const vehicle::Command& command,
                                 const ControlMeasurements& measured, double dt) {
  vehicle::Command level = command;
  level.v = 0.0;
  if (predicted_attitude_.is_trusted()) {
    level.o = from_rpy(0.0, 0.0, drift_stop_.heading(predicted_attitude_.q_WB(), measured.v_B));
    rates_ = autopilot_.step(level, predicted_attitude_.q_WB(), predicted_attitude_.omega_B(),
                             measured.depth_m, dt);
    if (predicted_attitude_.tilt() > kTilted) rates_.heave = 0.0;
  } else {
    level.o = Eigen::Quaterniond::Identity();
    rates_ = autopilot_.step(level, level.o, Eigen::Vector3d::Zero(), measured.depth_m, dt);
    rates_.yaw = kSpin;
    // Without attitude and depth: an uncontrolled vehicle rises slowly and pushes against nothing.
    if (!measured.depth_is_fresh && command.d >= 0.0) rates_ = {};
  }
}

}  // namespace dive::mission
