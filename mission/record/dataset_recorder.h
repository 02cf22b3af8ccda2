#pragma once
// Records the sensors of a simulated dive for estimators: images, IMU and depth go into an ASL
// dataset. The dive itself is unaffected.

#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "mission/record/asl_writer.h"
#include "planning/world/world.h"
#include "vehicle/simulator/cameras/stereo_camera.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// Parameters of the simulated cameras and of the IMU in `conditions`, which must have one.
[[nodiscard]] AslSensors asl_sensors(const vehicle::StereoCameraOptions& cameras,
                                     const vehicle::Conditions& conditions,
                                     const std::string& comment);

class DatasetRecorder {
 public:
  /// `conditions` are those of the dive and include an IMU. `existing`: AslWriter::create().
  [[nodiscard]] static tl::expected<DatasetRecorder, OutputError> create(
      const std::string& folder, Existing existing, const planning::World& world,
      const vehicle::StereoCameraOptions& camera, const vehicle::Conditions& conditions,
      std::uint64_t seed, const std::string& comment);

  /// Called once per tick with the simulator's samples; X_WD: pose of a diver in the water.
  void observe(const vehicle::SensorSamples& samples, const vehicle::GroundTruth& truth,
               const std::optional<Pose>& X_WD);
  [[nodiscard]] int pairs() const { return pairs_; }
  [[nodiscard]] tl::expected<void, OutputError> close() { return writer_.close(); }

 private:
  DatasetRecorder(AslWriter writer, vehicle::StereoCamera camera)
      : writer_(std::move(writer)), camera_(std::move(camera)) {}

  AslWriter writer_;
  vehicle::StereoCamera camera_;
  int pairs_ = 0;
};

}  // namespace dive::mission
