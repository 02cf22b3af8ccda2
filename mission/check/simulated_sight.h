#pragma once
// The cameras and the inertial unit of a simulated vehicle, and the estimator that looks through
// them.

#include <cstdint>
#include <optional>
#include <vector>

#include "common/clock.h"
#include "common/tag.h"
#include "mission/check/faults.h"
#include "mission/check/simulated_cameras.h"
#include "mission/document/mission.h"
#include "mission/executive/vision_service.h"
#include "planning/world/world.h"
#include "vehicle/simulator/named_waters.h"
#include "vehicle/simulator/simulator.h"
#include "vehicle/simulator/stereo_camera.h"

namespace dive::mission {

struct SightSettings {
  vehicle::StereoCameraOptions cameras;    ///< With the tags that are really there.
  std::vector<Tag> tags;                   ///< Where the estimator is told that they are.
  Utime latency = 80'000;                  ///< From a pair of pictures to its answer.
  RangeMaker make_range = nullptr;         ///< May be empty.
  std::optional<LoopSettings> loops = {};  ///< VisionService
};

/// What an estimator is told of such cameras and such an inertial unit: calibrated, and no more.
[[nodiscard]] estimation::VisionOptions vision_options(const vehicle::StereoCameraOptions& cameras,
                                                       const vehicle::ImuNoise& unit,
                                                       std::vector<Tag> tags = {});

/// Of a mission that closes loops, with a latency from a keyframe to its answer.
[[nodiscard]] std::optional<LoopSettings> loop_settings(const Mission& mission, Utime latency);

/// Of the tracker, by that of the dive.
[[nodiscard]] std::uint64_t tracker_seed(std::uint64_t seed);

class SimulatedSight {
 public:
  /// Demands cameras that validate. `conditions` are those of the dive.
  SimulatedSight(const planning::World& world, const SightSettings& settings,
                 const vehicle::Conditions& conditions, std::uint64_t seed);

  /// What comes in a tick; the depth as the executive gets to hear it.
  void hear(vehicle::InertialSamples samples, const std::optional<DepthSample>& depth,
            const FaultInjector& faults);
  /// After hear(): takes pictures where they are due, spoiled by what ails the cameras.
  void look(const vehicle::GroundTruth& truth, const std::optional<Pose>& X_WD,
            const FaultInjector& faults, const estimation::StateEstimate& published);
  [[nodiscard]] std::optional<estimation::VisionEstimate> poll(Utime now) {
    return service_.poll(now);
  }
  /// As VisionService has it.
  [[nodiscard]] std::optional<RangeScan> take_scan() { return service_.take_scan(); }

 private:
  SimulatedCameras cameras_;
  VisionService service_;
};

}  // namespace dive::mission
