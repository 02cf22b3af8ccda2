#include "mission/onboard/stereo_eyes.h"

#include <memory>
#include <utility>

#include "estimation/visual_inertial/stereo_range/stereo_range.h"

namespace dive::mission {

tl::expected<StereoEyes, std::string> stereo_eyes(const CameraModel& left, const CameraModel& right,
                                                  planning::MapperOptions mapper) {
  auto created = estimation::StereoRange::create({}, left, right);
  if (!created) return tl::unexpected(created.error());
  mapper.noise_square = created->noise_square();
  // A std::function is copied, and what it holds with it.
  const auto ranges = std::make_shared<estimation::StereoRange>(std::move(*created));
  const auto make_range = [ranges](const SeenPair& pair) -> std::optional<RangeScan> {
    if (pair.left == nullptr || pair.right == nullptr) return std::nullopt;
    auto seen = ranges->look(*pair.left, *pair.right);
    if (!seen) return std::nullopt;
    return std::move(seen->scan);
  };
  return StereoEyes{make_range, mapper};
}

}  // namespace dive::mission
