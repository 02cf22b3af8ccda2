#pragma once
// The executive as a process of its own: samples in over LCM, commands out, topside heard.
//
// Time is the vehicle's: the executive's clock starts at the time of the first samples and then
// runs with the machine's monotonic clock, so that a restarted executive goes on in the same time
// and no clock that is set can disturb a dive. In lock-step with a simulated vehicle its ticks are
// the vehicle's.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "estimation/visual_inertial/vision_pipeline.h"
#include "mission/check/simulated_dive.h"
#include "mission/executive/executive.h"
#include "mission/link/sight_inbox.h"
#include "planning/mapping/mapper.h"
#include "planning/planner.h"
#include "planning/world/seen.h"
#include "vehicle/link/authority.h"
#include "vehicle/link/bus.h"

namespace dive::mission {

struct LinkSettings {
  std::uint64_t seed = 1;
  bool lockstep = false;
  std::optional<link::Key> key;
  std::optional<Resume> resume;
  double patience_s = 60.0;       ///< To wait for the vehicle's first samples.
  int planner_latency_ticks = 5;  ///< At least; in lock-step exactly.
  planning::PlannerOptions planner;
  // In unknown water:
  int mapper_latency_ticks = 2;  ///< At least; in lock-step exactly.
  planning::MapperOptions mapper;
  // Where the mission asks for the visual-inertial estimator:
  /// Absent: of the simulated cameras. Where they are the eyes, such as stereo_eyes() takes.
  std::optional<estimation::VisionOptions> vision = {};
  int vision_latency_ticks = 4;  ///< At least; in lock-step exactly.
  int loop_latency_ticks = 20;   ///< Likewise.
};

/// How the control loop kept time.
struct LinkStats {
  std::int64_t ticks = 0;
  std::int64_t skipped = 0;        ///< Ticks that the machine was too late for.
  std::vector<float> lateness_ms;  ///< Of every tick, in order; empty in lock-step.
  std::vector<float> abort_ms;     ///< From the arrival of an abort to the command that obeys it.
  int clock_jumps = 0;             ///< Of sensors.
  link::Refusals refused;          ///< Of operator requests.
  std::int64_t malformed = 0;      ///< Packets that were none.
  std::optional<SightStats> sight = {};  ///< Where it goes by sight, not in lock-step.
};

struct LinkedResult {
  std::string outcome;  ///< success, aborted, failure (no vehicle)
  std::string final_state;
  std::string cause;
  double duration_s = 0.0;
  double distance_m = 0.0;  ///< As estimated.
  int plans = 0;
  int replans = 0;
  std::vector<TimedTransition> transitions;
  LinkStats stats;
  planning::SeenMap seen;                         ///< In unknown water: the map at the end ...
  std::vector<Eigen::Vector3f> seen_points = {};  ///< ... and its points, in W.
};

/// Told every tick, after its command is out; `truth` only where a simulated vehicle says it.
using LinkObserver = std::function<void(const StepInputs&, const StepOutputs&,
                                        const std::optional<link::Truth>& truth)>;

/// Dives until the machine has ended or half as long again as the mission may last, which is an
/// abort that somebody else must finish: the supervisor, or the vehicle itself. In unknown water
/// nothing of `world` is used: there are the vehicle's scans.
[[nodiscard]] LinkedResult dive_over_link(const Mission& mission, const planning::World& world,
                                          const vehicle::Model& model, const LinkSettings& settings,
                                          link::Bus& bus, Clock& clock,
                                          const LinkObserver& observer, const DiveKeeper& keeper);

}  // namespace dive::mission
