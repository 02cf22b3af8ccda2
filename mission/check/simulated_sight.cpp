#include "mission/check/simulated_sight.h"

#include <utility>

namespace dive::mission {
namespace {

constexpr std::uint64_t kTrackerStream = 0x7ac4;

vehicle::CameraFault fault_of(const FaultInjector& faults, int camera) {
  if (faults.is_on(FaultKind::kCameraMissing)) return vehicle::CameraFault::kMissing;
  if (camera == 1 && faults.is_on(FaultKind::kCameraOneEye)) return vehicle::CameraFault::kMissing;
  if (faults.is_on(FaultKind::kCameraBlackout)) return vehicle::CameraFault::kBlackout;
  if (faults.is_on(FaultKind::kCameraFrozen)) return vehicle::CameraFault::kFrozen;
  if (faults.is_on(FaultKind::kCameraBlur)) return vehicle::CameraFault::kBlur;
  return vehicle::CameraFault::kNone;
}

}  // namespace

estimation::VisionOptions vision_options(const vehicle::StereoCameraOptions& cameras,
                                         const vehicle::ImuNoise& unit, std::vector<Tag> tags) {
  estimation::VisionOptions options;
  options.period_s = 1.0 / cameras.rate_hz;
  options.filter.cameras = {cameras.camera(0), cameras.camera(1)};
  options.filter.imu = {unit.gyro_density, unit.accel_density, unit.gyro_walk, unit.accel_walk};
  options.tags = std::move(tags);
  return options;
}

SimulatedSight::SimulatedSight(const planning::World& world, const SightSettings& settings,
                               const vehicle::Conditions& conditions, std::uint64_t seed)
    : cameras_(world, settings.cameras, seed),
      service_(
          vision_options(settings.cameras, conditions.inertial_unit.value_or(vehicle::ImuNoise{}),
                         settings.tags),
          seed ^ kTrackerStream, settings.latency, Late::kWait, settings.make_range) {
  cameras_.set_current(conditions.current_W);
}

void SimulatedSight::hear(vehicle::InertialSamples samples, const std::optional<DepthSample>& depth,
                          const FaultInjector& faults) {
  faults.apply(samples);
  service_.hear(samples.list());
  if (depth) service_.hear(*depth);
}

void SimulatedSight::look(const vehicle::GroundTruth& truth, const std::optional<Pose>& X_WD,
                          const FaultInjector& faults, const estimation::StateEstimate& published) {
  service_.observe(published);
  if (!cameras_.due(truth.utime)) return;
  for (const int camera : {0, 1}) cameras_.set_fault(camera, fault_of(faults, camera));
  auto [left, right] = cameras_.take(truth.utime, truth.X_WB, X_WD);
  service_.submit(std::move(left), std::move(right), truth.utime);
}

}  // namespace dive::mission
