#include "mission/record/dataset_recorder.h"

#include <utility>

#include "common/assert.h"

namespace dive::mission {

AslSensors asl_sensors(const vehicle::StereoCameraOptions& cameras,
                       const vehicle::Conditions& conditions, const std::string& comment) {
  DIVE_DEMAND(conditions.inertial_unit.has_value());
  AslSensors sensors;
  sensors.cameras = {cameras.camera(0), cameras.camera(1)};
  sensors.camera_rate_hz = cameras.rate_hz;
  sensors.imu_rate_hz = vehicle::InertialSamples::kPerTick / vehicle::Simulator::kTick;
  sensors.imu = *conditions.inertial_unit;
  sensors.depth_rate_hz = 1.0 / vehicle::Simulator::kTick;
  sensors.depth_sigma_m = conditions.depth_noise_m;
  sensors.comment = comment;
  return sensors;
}

tl::expected<DatasetRecorder, OutputError> DatasetRecorder::create(
    const std::string& folder, Existing existing, const planning::World& world,
    const vehicle::StereoCameraOptions& camera, const vehicle::Conditions& conditions,
    std::uint64_t seed, const std::string& comment) {
  tl::expected<AslWriter, OutputError> writer =
      AslWriter::create(folder, asl_sensors(camera, conditions, comment), existing);
  if (!writer) return tl::unexpected(writer.error());
  vehicle::StereoCamera eyes(world, camera, seed);
  eyes.set_current(conditions.first_current_W());
  return DatasetRecorder(std::move(*writer), std::move(eyes));
}

void DatasetRecorder::observe(const vehicle::SensorSamples& samples,
                              const vehicle::GroundTruth& truth, const std::optional<Pose>& X_WD) {
  writer_.write(AslTruth{truth.utime, truth.X_WB, truth.X_WB.q * truth.v_WB_B, truth.gyro_bias_B,
                         truth.accel_bias_B});
  for (const ImuSample& sample : samples.inertial.list()) writer_.write(sample);
  if (samples.depth) writer_.write(*samples.depth);
  if (!camera_.due(truth.utime)) return;
  for (const auto& frame : camera_.take(truth.utime, truth.X_WB, X_WD)) {
    if (frame) writer_.write(*frame);
  }
  ++pairs_;
}

}  // namespace dive::mission
