#pragma once
// The state of the vehicle and of the mission's progress in one tick. The stages of the executive
// fill it in order; failsafes, guards, events and behaviours each read a view of it. Private to
// mission/executive.

#include <optional>
#include <string>

#include "behaviors/behavior.h"
#include "behaviors/monitors.h"
#include "common/clock.h"
#include "common/map_fix.h"
#include "common/measurements.h"
#include "estimation/state_estimate.h"
#include "mission/document/guard.h"
#include "mission/executive/recording_loss.h"
#include "planning/certify/position_margin.h"
#include "vehicle/command.h"

namespace dive::mission {

/// The sensors usable in this tick; decided once, by Sensing.
struct SensorStatus {
  bool imu_is_fresh = false;    ///< True if the attitude is measured.
  bool depth_is_fresh = false;  ///< True if the depth is measured.
  double depth_m = 0.0;         ///< Last measured depth, m.
};

struct Situation {
  // Time.
  Utime now = 0;
  Utime mission_now = 0;         ///< Time on the behaviours' clock, which stops during a hold.
  double elapsed_s = 0.0;        ///< Time since the mission started, s.
  double state_elapsed_s = 0.0;  ///< Time since the innermost state was entered, s.

  // Vehicle.
  SensorStatus sensors;
  behaviors::SensorLoss imu_loss = behaviors::SensorLoss::kSilent;    ///< Of the last imu_lost.
  behaviors::SensorLoss depth_loss = behaviors::SensorLoss::kSilent;  ///< Of the last depth_lost.
  HealthSample health;
  MapAgreement map_agreement;  ///< Agreement of the last seconds' scans with the known map.
  estimation::StateEstimate estimate;
  Eigen::Vector2d current_W = Eigen::Vector2d::Zero();  ///< Declared current, m/s.
  bool position_corrected = false;                      ///< The position has jumped in this tick.
  bool trail_moved = false;       ///< A loop closure has moved the trail in this tick.
  vehicle::Command last_command;  ///< Command of the previous tick.
  double expected_heave = 0.0;    ///< Heave expected from the efforts of the previous tick, m/s.

  // Environment.
  bool overhead = false;    ///< True if something solid is above the vehicle.
  bool open_above = false;  ///< True if nothing solid is above it or where it may drift to.
  bool map_opened = false;  ///< True in the tick in which an object of the map is found to be gone.
  bool obstacle_ahead = false;  ///< True in the tick of a scan that shows an obstacle in the way.
  bool can_ascend = false;  ///< True if a vertical ascent is open, or the best remaining option.
  /// Height above the ground vertically below; empty without ground.
  std::optional<double> altitude_m;
  /// What the uncertainty of the position leaves of the clearance to the known map.
  planning::PositionMargin margin;
  double penetration_m = 0.0;  ///< Distance back along the trail to open water, m.
  /// Fraction used of the time or energy usable since open water.
  double budget_used = 0.0;

  // Mission.
  behaviors::Progress progress;  ///< Progress of the active behaviour.
  bool ascends = false;          ///< The active behaviour ascends vertically in open water.
  bool out_of_replans = false;
  std::string operator_abort;  ///< Cause of an operator's abort; empty without one.
  bool is_terminated = false;  ///< SIGTERM or SIGINT: no executive will take over from this one.
  bool retrace_failed = false;
  RecordingLoss loss;           ///< Losses of log and journal.
  std::string retrace_failure;  ///< Reason of a failed retrace; empty without one.
  std::string internal_error;   ///< Failed assertion; empty without one.
};

[[nodiscard]] GuardVariables guard_variables(const Situation& situation);
[[nodiscard]] behaviors::MonitorInput monitor_input(const Situation& situation);
[[nodiscard]] behaviors::BehaviorInput behavior_input(const Situation& situation);

}  // namespace dive::mission
