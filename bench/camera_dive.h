#pragma once
// Dives of shipped missions as inputs of a visual-inertial estimator: the simulator's IMU and depth
// sensor, and the camera images at the true poses.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/study_setup.h"
#include "common/measurements.h"
#include "vehicle/simulator/cameras/stereo_camera.h"
#include "vehicle/simulator/simulator.h"

namespace dive::bench {

/// One control tick.
struct DiveTick {
  vehicle::GroundTruth truth;
  vehicle::SensorSamples samples;
};

/// The whole mission, without cameras.
[[nodiscard]] std::vector<DiveTick> swim(const StudySetup& setup, std::uint64_t seed);

/// `seconds` of the dive under water and in motion, chosen by `seed`; fewer if it is too short.
[[nodiscard]] std::vector<DiveTick> stretch_of(const std::vector<DiveTick>& dive, double seconds,
                                               std::uint64_t seed);

using Images = std::array<ImageFrame, 2>;

/// Calls `see` for every tick of `stretch`, with images when they are due. With a `folder`, images
/// are stored there and reused the next time.
void render(const StudySetup& setup, const std::vector<DiveTick>& stretch,
            const vehicle::StereoCameraOptions& camera, const std::string& water,
            std::uint64_t seed, const std::string& folder,
            const std::function<void(const DiveTick&, const Images*)>& see);

}  // namespace dive::bench
