#include "mission/onboard/stereo_mapping.h"

#include <memory>
#include <utility>

#include "estimation/visual_inertial/stereo_range/stereo_range.h"

namespace dive::mission {

tl::expected<StereoMapping, std::string> stereo_mapping(const CameraModel& left,
                                                        const CameraModel& right,
                                                        planning::MapperOptions mapper) {
  auto created = estimation::StereoRange::create({}, left, right);
  if (!created) return tl::unexpected(created.error());
  mapper.noise.square = created->noise_square();
  // A std::function is copied, and what it holds with it.
  const auto ranges = std::make_shared<estimation::StereoRange>(std::move(*created));
  const auto make_range = [ranges](const StereoPairResult& pair) -> std::optional<RangeScan> {
    if (pair.left == nullptr || pair.right == nullptr) return std::nullopt;
    auto stereo_scan = ranges->measure(*pair.left, *pair.right);
    if (!stereo_scan) return std::nullopt;
    return std::move(stereo_scan->scan);
  };
  return StereoMapping{make_range, mapper};
}

}  // namespace dive::mission
