#pragma once
// The front cameras of a simulated vehicle, their faults, and their calibration.

#include <cstdint>
#include <optional>

#include "estimation/visual_inertial/pipeline/vision_pipeline.h"
#include "mission/simulation/faults.h"
#include "planning/world/world.h"
#include "vehicle/simulator/cameras/stereo_camera.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// Calibration of the simulated cameras and IMU, as exact as the simulator itself.
[[nodiscard]] estimation::VisionOptions vision_options(const vehicle::StereoCameraOptions& cameras,
                                                       const vehicle::ImuNoise& imu);

/// Adds the IMU that belongs to the cameras, unless `conditions` have one.
[[nodiscard]] vehicle::Conditions with_imu(vehicle::Conditions conditions);

class SimulatedCameras {
 public:
  /// Requires cameras that validate. `conditions` are those of the dive.
  SimulatedCameras(const planning::World& world, const vehicle::StereoCameraOptions& cameras,
                   const vehicle::Conditions& conditions, std::uint64_t seed);

  /// Images, when due; X_WD: pose of the diver in the water.
  [[nodiscard]] vehicle::StereoFrames render(const vehicle::GroundTruth& truth,
                                             const std::optional<Pose>& X_WD,
                                             const FaultInjector& faults);

 private:
  vehicle::StereoCamera cameras_;
};

}  // namespace dive::mission
