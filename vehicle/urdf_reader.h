#pragma once
// From the text of a URDF file to urdfdom's model types. Internal to the URDF reader.
//
// A likely typo is an error: an element that is nearly a known one, an invalid number, a joint that
// names a missing link. Elements for other programs (gazebo, transmission, visual, foreign
// namespaces) are ignored.

#include <urdf_model/model.h>
#include <urdf_world/types.h>

#include "common/diagnostic.h"
#include "common/xml.h"

namespace dive::vehicle {

inline constexpr int kMaxJointChain = 64;  ///< Maximum joints between the root and any link.

/// Links, joints and their tree, in the file's order; nullptr after an error. Every geometry is a
/// box, cylinder or sphere with a positive size, every inertia positive definite, every joint
/// fixed, revolute, continuous or prismatic with an axis of length one and, where they apply,
/// limits with lower <= upper.
[[nodiscard]] urdf::ModelInterfaceSharedPtr read_urdf_model(const XmlDocument& document,
                                                            Diagnostics& diagnostics);

}  // namespace dive::vehicle
