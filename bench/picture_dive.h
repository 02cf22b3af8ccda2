#pragma once
// Dives of shipped missions as inputs of a visual-inertial estimator: the simulator's IMU and depth
// sensor, and the camera images at the true poses.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/site.h"
#include "common/measurements.h"
#include "vehicle/simulator/cameras/stereo_camera.h"
#include "vehicle/simulator/simulator.h"

namespace dive::bench {

/// One control tick.
struct SwumTick {
  vehicle::GroundTruth truth;
  vehicle::SensorSamples samples;
};

/// The whole mission, without cameras.
[[nodiscard]] std::vector<SwumTick> swim(const Site& site, std::uint64_t seed);

/// `seconds` of the dive under water and in motion, chosen by `seed`; fewer if it is too short.
[[nodiscard]] std::vector<SwumTick> stretch_of(const std::vector<SwumTick>& dive, double seconds,
                                               std::uint64_t seed);

using Pictures = std::array<ImageFrame, 2>;

/// Calls `see` for every tick of `stretch`, with images when they are due. With a `folder`, images
/// are stored there and reused the next time.
void look(const Site& site, const std::vector<SwumTick>& stretch,
          const vehicle::StereoCameraOptions& camera, const std::string& water, std::uint64_t seed,
          const std::string& folder,
          const std::function<void(const SwumTick&, const Pictures*)>& see);

}  // namespace dive::bench
