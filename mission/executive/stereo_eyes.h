#pragma once
// In unknown water, of a mission whose eyes are its cameras: the stereo pair in the place of a
// range sensor.

#include "common/camera_model.h"
#include "mission/executive/vision_service.h"
#include "planning/mapping/mapper.h"

namespace dive::mission {

struct StereoEyes {
  RangeMaker make_range;
  planning::MapperOptions mapper;  ///< As given, with the noise that such ranges have.
};

/// Demands a pair that can be rectified, the right one to the right of the left one. A pair of
/// pictures of which one is missing, or that cannot be matched, gives no sweep.
[[nodiscard]] StereoEyes stereo_eyes(const CameraModel& left, const CameraModel& right,
                                     planning::MapperOptions mapper);

}  // namespace dive::mission
