#include "mission/simulation/simulated_cameras.h"

namespace dive::mission {
namespace {

vehicle::CameraFault fault_of(const FaultInjector& faults, int camera) {
  if (faults.is_on(FaultKind::kCameraMissing)) return vehicle::CameraFault::kMissing;
  if (camera == 1 && faults.is_on(FaultKind::kCameraRightMissing))
    return vehicle::CameraFault::kMissing;
  if (faults.is_on(FaultKind::kCameraBlackout)) return vehicle::CameraFault::kBlackout;
  if (faults.is_on(FaultKind::kCameraFrozen)) return vehicle::CameraFault::kFrozen;
  if (faults.is_on(FaultKind::kCameraBlur)) return vehicle::CameraFault::kBlur;
  return vehicle::CameraFault::kNone;
}

// A calibration file has the rotation as a matrix: the attitude as a reader gets it, so that a dive
// over the link computes with the same cameras to the last bit.
CameraModel as_written(CameraModel camera) {
  camera.X_BC.q = Eigen::Quaterniond(camera.X_BC.q.toRotationMatrix()).normalized();
  return camera;
}

}  // namespace

estimation::VisionOptions vision_options(const vehicle::StereoCameraOptions& cameras,
                                         const vehicle::ImuNoise& imu) {
  estimation::VisionOptions options;
  options.period_s = 1.0 / cameras.rate_hz;
  options.filter.cameras = {as_written(cameras.camera(0)), as_written(cameras.camera(1))};
  options.filter.imu = {imu.gyro_density, imu.accel_density, imu.gyro_walk, imu.accel_walk,
                        imu.g_sensitivity_sigma};
  options.filter.gyro_bias_sigma = imu.gyro_bias_sigma;
  options.filter.accel_bias_sigma = imu.accel_bias_sigma;
  options.filter.imu_scale_sigma = imu.scale_sigma;
  return options;
}

vehicle::Conditions with_imu(vehicle::Conditions conditions) {
  if (!conditions.inertial_unit) conditions.inertial_unit = vehicle::ImuNoise{};
  return conditions;
}

SimulatedCameras::SimulatedCameras(const planning::World& world,
                                   const vehicle::StereoCameraOptions& cameras,
                                   const vehicle::Conditions& conditions, std::uint64_t seed)
    : cameras_(world, cameras, seed) {
  cameras_.set_current(conditions.first_current_W());
}

vehicle::StereoFrames SimulatedCameras::render(const vehicle::GroundTruth& truth,
                                               const std::optional<Pose>& X_WD,
                                               const FaultInjector& faults) {
  if (!cameras_.due(truth.utime)) return {};
  for (const int camera : {0, 1}) cameras_.set_fault(camera, fault_of(faults, camera));
  return cameras_.take(truth.utime, truth.X_WB, X_WD);
}

}  // namespace dive::mission
