#pragma once
// In unknown water, of a mission whose eyes are its cameras: the stereo pair in the place of a
// range sensor.

#include <string>

#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "mission/onboard/vision_service.h"
#include "planning/mapping/mapper.h"

namespace dive::mission {

struct StereoEyes {
  RangeMaker make_range;
  planning::MapperOptions mapper;  ///< As given, with the noise that such ranges have.
};

/// A pair of pictures of which one is missing, or that cannot be matched, gives no sweep. An error
/// is a sentence: cameras that are no stereo pair.
[[nodiscard]] tl::expected<StereoEyes, std::string> stereo_eyes(const CameraModel& left,
                                                                const CameraModel& right,
                                                                planning::MapperOptions mapper);

}  // namespace dive::mission
