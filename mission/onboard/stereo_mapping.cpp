#include "mission/onboard/stereo_mapping.h"

#include <memory>
#include <utility>

#include "estimation/visual_inertial/filter/landmark_points.h"
#include "estimation/visual_inertial/stereo_range/stereo_range.h"

namespace dive::mission {

namespace {

void add_landmarks(const StereoPairResult& pair, const RangeNoise& noise, RangeScan& scan) {
  for (const Eigen::Vector3f& p_B :
       estimation::landmark_points_B(*pair.estimate, pair.landmarks, noise)) {
    // A point beyond the reach would mean that nothing is in the way.
    const bool is_in_reach = (p_B - scan.origin_B).norm() < scan.reach;
    if (!is_in_reach || scan.points_B.size() >= kMaxScanPoints) continue;
    scan.points_B.push_back(p_B);
    ++scan.landmarks;
  }
}

}  // namespace

tl::expected<StereoMapping, std::string> stereo_mapping(const CameraModel& left,
                                                        const CameraModel& right,
                                                        planning::MapperOptions mapper,
                                                        bool adds_landmarks) {
  auto created = estimation::StereoRange::create({}, left, right);
  if (!created) return tl::unexpected(created.error());
  mapper.noise.square = created->noise_square();
  // A std::function is copied, and what it holds with it.
  const auto ranges = std::make_shared<estimation::StereoRange>(std::move(*created));
  const auto make_range = [ranges, noise = mapper.noise, adds_landmarks](
                              const StereoPairResult& pair) -> std::optional<RangeScan> {
    if (pair.left == nullptr || pair.right == nullptr) return std::nullopt;
    auto stereo_scan = ranges->measure(*pair.left, *pair.right);
    if (!stereo_scan) return std::nullopt;
    RangeScan scan = std::move(stereo_scan->scan);
    if (adds_landmarks && pair.estimate) add_landmarks(pair, noise, scan);
    return scan;
  };
  return StereoMapping{make_range, mapper};
}

}  // namespace dive::mission
