#pragma once
// What the sensors of a simulated dive would have recorded, for estimators: the cameras look, the
// inertial unit feels, and all of it goes into an ASL dataset. The dive itself knows nothing of it.

#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "mission/record/asl_writer.h"
#include "planning/world/world.h"
#include "vehicle/simulator/simulator.h"
#include "vehicle/simulator/stereo_camera.h"

namespace dive::mission {

class DatasetRecorder {
 public:
  /// `conditions` are those of the dive, with an inertial unit. The error is a sentence.
  [[nodiscard]] static tl::expected<DatasetRecorder, std::string> create(
      const std::string& folder, const planning::World& world,
      const vehicle::StereoCameraOptions& camera, const vehicle::Conditions& conditions,
      std::uint64_t seed, const std::string& comment);

  /// Once a tick, with what the simulator has returned; X_WD: that of a diver in the water.
  void observe(const vehicle::SensorSamples& samples, const vehicle::GroundTruth& truth,
               const std::optional<Pose>& X_WD);
  [[nodiscard]] int pairs() const { return pairs_; }
  [[nodiscard]] tl::expected<void, std::string> close() { return writer_.close(); }

 private:
  DatasetRecorder(AslWriter writer, vehicle::StereoCamera camera)
      : writer_(std::move(writer)), camera_(std::move(camera)) {}

  AslWriter writer_;
  vehicle::StereoCamera camera_;
  int pairs_ = 0;
};

}  // namespace dive::mission
