#pragma once
// The front cameras of a simulated vehicle, spoiled by what ails them.

#include <cstdint>
#include <optional>

#include "mission/check/faults.h"
#include "planning/world/world.h"
#include "vehicle/simulator/simulator.h"
#include "vehicle/simulator/stereo_camera.h"

namespace dive::mission {

class SimulatedCameras {
 public:
  /// Demands cameras that validate. `conditions` are those of the dive.
  SimulatedCameras(const planning::World& world, const vehicle::StereoCameraOptions& cameras,
                   const vehicle::Conditions& conditions, std::uint64_t seed);

  /// Pictures where they are due; X_WD: of the diver in the water.
  [[nodiscard]] vehicle::StereoFrames look(const vehicle::GroundTruth& truth,
                                           const std::optional<Pose>& X_WD,
                                           const FaultInjector& faults);

 private:
  vehicle::StereoCamera cameras_;
};

}  // namespace dive::mission
