#include "mission/executive/helm.h"

#include "common/assert.h"
#include "common/se3.h"

namespace dive::mission {
namespace {

constexpr double kTilted = 0.2;  // rad

}  // namespace

double Helm::expected_heave(double speed) const {
  return vehicle::expected_heave(options_, rates_.heave - autopilot_.trim_effort(), speed);
}

void Helm::step(const vehicle::Command& command, const Heard& heard, double dt) {
  DIVE_DEMAND(heard.imu != nullptr && dt > 0.0);
  if (!heard.hears_imu) return steer_blindly(command, heard, dt);
  reckoned_.start(heard.imu->q_WB, heard.imu->gyro_B);
  rates_ = autopilot_.step(command, heard.imu->q_WB, heard.imu->gyro_B, heard.depth_m, dt);
}

// Stops, comes level by what the turn must have become, and then does only what needs no
// attitude: the depth loop, as if level. A tilted vehicle that heaves would push itself sideways.
void Helm::steer_blindly(const vehicle::Command& command, const Heard& heard, double dt) {
  reckoned_.advance(rates_, dt);
  vehicle::Command level = command;
  level.v = 0.0;
  level.o = from_rpy(0.0, 0.0, to_rpy(heard.imu->q_WB).z());
  if (reckoned_.is_trusted()) {
    rates_ = autopilot_.step(level, reckoned_.q_WB(), reckoned_.omega_B(), heard.depth_m, dt);
    if (reckoned_.tilt() > kTilted) rates_.heave = 0.0;
  } else {
    rates_ = autopilot_.step(level, level.o, Eigen::Vector3d::Zero(), heard.depth_m, dt);
    // Blind and deaf: a vehicle that is left alone rises slowly, and pushes against nothing.
    if (!heard.hears_depth && command.d >= 0.0) rates_ = {};
  }
}

}  // namespace dive::mission
