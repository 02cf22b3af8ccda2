#include "mission/report/clearances.h"

#include <algorithm>
#include <cmath>

#include "vehicle/simulator/ground_truth/ground_truth.h"

namespace dive::mission {
namespace {

constexpr double kNearShare = 0.5;  // of D_min
constexpr double kMapError = 0.15;  // m, by which objects may lie off the map

}  // namespace

void measure_clearances(const planning::World& world, const planning::RobotHull& hull,
                        std::size_t count, std::vector<DiveSample>& samples) {
  if (world.obstacles.empty() || count == 0) return;
  const bool has_truth = std::ranges::any_of(
      samples, [](const DiveSample& sample) { return sample.truth.has_value(); });
  const vehicle::ClearanceMeter meter(world, hull);
  const std::size_t stride = (samples.size() + count - 1) / count;
  for (std::size_t i = 0; i < samples.size(); i += stride) {
    DiveSample& sample = samples[i];
    const std::optional<Pose>& pose = has_truth ? sample.truth : sample.estimate;
    if (pose && pose->is_finite()) sample.clearance_m = meter.clearance(*pose);
  }
}

std::vector<NearMiss> near_misses(const planning::World& world, const planning::RobotHull& hull,
                                  double clearance_required_m, double least_m,
                                  const std::vector<DiveSample>& samples) {
  std::vector<NearMiss> found;
  const double bound = kNearShare * clearance_required_m;
  const vehicle::TriangulatedWorld triangles(world);
  const DiveSample* nearest = nullptr;
  const auto end_approach = [&] {
    if (nearest != nullptr && nearest->clearance_m > std::max(0.0, least_m - kMapError)) {
      vehicle::ClearanceMeter meter(triangles, hull);
      static_cast<void>(meter.observe(*nearest->truth));
      found.push_back(
          {nearest->t_s, nearest->truth->p, nearest->clearance_m, meter.nearest_obstacle()});
    }
    nearest = nullptr;
  };
  for (const DiveSample& sample : samples) {
    if (!sample.truth || std::isnan(sample.clearance_m)) continue;
    if (sample.clearance_m >= bound) {
      end_approach();
    } else if (nearest == nullptr || sample.clearance_m < nearest->clearance_m) {
      nearest = &sample;
    }
  }
  end_approach();
  return found;
}

}  // namespace dive::mission
