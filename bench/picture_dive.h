#pragma once
// Dives of shipped missions as a visual-inertial estimator would have them: the simulator's
// inertial unit and depth sensor, and what the cameras see from where the vehicle truly was.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/site.h"
#include "common/measurements.h"
#include "vehicle/simulator/simulator.h"
#include "vehicle/simulator/stereo_camera.h"

namespace dive::bench {

/// One control tick.
struct SwumTick {
  vehicle::GroundTruth truth;
  vehicle::SensorSamples samples;
};

/// The whole mission, without eyes.
[[nodiscard]] std::vector<SwumTick> swim(const Site& site, std::uint64_t seed);

/// `seconds` of it in which it swims under water, chosen by `seed`; fewer where it is too short.
[[nodiscard]] std::vector<SwumTick> stretch_of(const std::vector<SwumTick>& dive, double seconds,
                                               std::uint64_t seed);

using Pictures = std::array<ImageFrame, 2>;

/// Calls `see` for every tick of `stretch`, with pictures where they fall due. With a `folder` they
/// are kept there, and taken from there the next time.
void look(const Site& site, const std::vector<SwumTick>& stretch,
          const vehicle::StereoCameraOptions& camera, const std::string& water, std::uint64_t seed,
          const std::string& folder,
          const std::function<void(const SwumTick&, const Pictures*)>& see);

}  // namespace dive::bench
