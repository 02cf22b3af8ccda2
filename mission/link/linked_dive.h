#pragma once
// The executive as a separate process: receives samples and topside's requests over LCM, sends
// commands.
//
// Time is the vehicle's: the executive's clock starts at the time of the first samples and then
// follows the machine's monotonic clock, so that a restarted executive continues in the same time
// base and setting a clock cannot disturb a dive. In lock-step with a simulated vehicle its ticks
// are the vehicle's.

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "estimation/visual_inertial/pipeline/vision_pipeline.h"
#include "mission/link/camera_inbox.h"
#include "mission/onboard/onboard_dive.h"
#include "mission/onboard/settings.h"
#include "planning/world/observed_map.h"
#include "vehicle/link/authority.h"
#include "vehicle/link/bus.h"

namespace dive::mission {

struct LinkSettings : OnboardSettings {
  bool lockstep = false;
  double timeout_s = 60.0;  ///< Maximum wait for the vehicle's first samples.
  /// Calibration of the vehicle's cameras and IMU. Required with the visual-inertial estimator; a
  /// stereo pair (stereo_mapping()) is required where the mission maps with its cameras.
  std::optional<estimation::VisionOptions> vision = {};
  /// Losses of log and journal so far. Empty: none are reported, as in simulation.
  std::function<RecordingLoss()> recording_loss = {};
  /// True if the journal has all payload commands so far on the disk. Empty: always.
  std::function<bool()> has_journaled_commands = {};
};

/// Timing of the control loop.
struct LinkStats {
  std::int64_t ticks = 0;
  std::int64_t skipped = 0;        ///< Ticks skipped because the machine was late.
  std::vector<float> lateness_ms;  ///< Lateness of each tick, in order; empty in lock-step.
  /// Time from the arrival of an abort to the command that executes it.
  std::vector<float> abort_ms;
  int clock_jumps = 0;          ///< Jumps of sensor clocks.
  link::Refusals refused;       ///< Refused operator requests.
  link::Rejections rejections;  ///< Packets that were not used.
  std::optional<CameraInboxStats> cameras =
      {};  ///< With visual-inertial estimation outside lock-step.
};

struct LinkedResult {
  std::string outcome;  ///< success, aborted, failure (no vehicle)
  std::string final_state;
  std::string cause;
  double duration_s = 0.0;
  double distance_m = 0.0;  ///< Estimated distance.
  /// estimation::horizontal_sigma() at the end, m; NaN without a valid estimate.
  double final_sigma_m = std::numeric_limits<double>::quiet_NaN();
  int plans = 0;
  int replans = 0;
  std::vector<TimedTransition> transitions;
  std::vector<ServiceFailure> service_failures;
  LinkStats stats;
  /// In an unknown environment: the map at the end.
  planning::ObservedMap observed_map;
  std::vector<Eigen::Vector3f> observed_points = {};  ///< Points of that map, in W.
};

/// Called every tick, after its command is sent; `truth` only with a simulated vehicle.
using LinkObserver = std::function<void(const StepInputs&, const StepOutputs&,
                                        const std::optional<link::Truth>& truth)>;

/// Runs until the machine has ended, or for 1.5 times the mission's maximum duration, which is an
/// abort that the supervisor or the vehicle itself must complete. In an unknown environment `world`
/// is not used: the vehicle's scans replace it.
[[nodiscard]] LinkedResult dive_over_link(const Mission& mission, const planning::World& world,
                                          const vehicle::Model& model, const LinkSettings& settings,
                                          link::Bus& bus, Clock& clock,
                                          const LinkObserver& observer, const DiveKeeper& keeper);

}  // namespace dive::mission
