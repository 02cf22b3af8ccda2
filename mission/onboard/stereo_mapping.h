#pragma once
// The stereo pair as the mapping sensor.

#include <string>

#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "mission/onboard/vision_service.h"
#include "planning/mapping/mapper.h"

namespace dive::mission {

struct StereoMapping {
  RangeMaker make_range;
  planning::MapperOptions mapper;  ///< The given options with the noise of stereo ranges.
};

/// `adds_landmarks`: scans contain the filter's landmarks. A pair with a missing image, or without
/// matches, gives no scan. The error is a sentence: the cameras are not a stereo pair.
[[nodiscard]] tl::expected<StereoMapping, std::string> stereo_mapping(
    const CameraModel& left, const CameraModel& right, planning::MapperOptions mapper,
    bool adds_landmarks);

}  // namespace dive::mission
