#pragma once
// <motion>, our extension of URDF: a child of <robot> that holds the coefficients of the vehicle's
// motion model, one element each, named as in motion_coefficients():
//
//   <motion>
//     <full_speed value="0.74" sigma="0.004"/>
//     ...
//   </motion>
//
// A coefficient that is absent keeps its value in MotionModel. sigma, one standard deviation, is
// for people; it is read only to be checked. Other readers of URDF ignore the element.

#include <optional>
#include <string>
#include <vector>

#include "common/diagnostic.h"
#include "common/motion_model.h"
#include "common/source_text.h"
#include "common/xml.h"

namespace dive::vehicle {

/// The coefficients of a description; nothing after an error (URDF-*).
[[nodiscard]] std::optional<MotionModel> read_motion(const XmlDocument& document,
                                                     Diagnostics& diagnostics);

/// The description with <motion> replaced by `motion`, or added as the last child. `sigmas`: one
/// for each of the first coefficients, 0 where unknown. The rest of the text is unchanged. Nothing
/// if the description cannot be read.
[[nodiscard]] std::optional<std::string> with_motion(const SourceText& urdf,
                                                     const MotionModel& motion,
                                                     const std::vector<double>& sigmas);

/// The description without <motion>: equal for all dives of one vehicle. `urdf` itself if it cannot
/// be read.
[[nodiscard]] std::string without_motion(const SourceText& urdf);

}  // namespace dive::vehicle
