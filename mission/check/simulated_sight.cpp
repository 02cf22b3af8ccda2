#include "mission/check/simulated_sight.h"

#include <utility>

namespace dive::mission {
namespace {

constexpr std::uint64_t kTrackerStream = 0x7ac4;

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

// In unknown water the map brings the vehicle back to what was seen before, and tags say where it
// is: what is corrected already is not to be corrected once more.
std::optional<LoopSettings> loop_settings(const Mission& mission, Utime latency) {
  if (!mission.closes_loops || mission.unknown || !mission.tags.empty()) return std::nullopt;
  LoopSettings settings;
  settings.latency = latency;
  return settings;
}

std::uint64_t tracker_seed(std::uint64_t seed) { return seed ^ kTrackerStream; }

SimulatedSight::SimulatedSight(const planning::World& world, const SightSettings& settings,
                               const vehicle::Conditions& conditions, std::uint64_t seed)
    : cameras_(world, settings.cameras, conditions, seed),
      service_(
          vision_options(settings.cameras, conditions.inertial_unit.value_or(vehicle::ImuNoise{}),
                         settings.tags),
          tracker_seed(seed), settings.latency, Late::kWait, settings.make_range, settings.loops) {}

void SimulatedSight::hear(vehicle::InertialSamples samples, const std::optional<DepthSample>& depth,
                          const FaultInjector& faults) {
  faults.apply(samples);
  service_.hear(samples.list());
  if (depth) service_.hear(*depth);
}

void SimulatedSight::look(const vehicle::GroundTruth& truth, const std::optional<Pose>& X_WD,
                          const FaultInjector& faults, const estimation::StateEstimate& published) {
  service_.observe(published);
  auto [left, right] = cameras_.look(truth, X_WD, faults);
  service_.submit(std::move(left), std::move(right), truth.utime);
}

}  // namespace dive::mission
