#pragma once
// Waypoints of ACFR's primitives: goto, leg, and the patterns that cover an area.

#include <cstddef>

#include "mission/import/acfr_elements.h"

namespace dive::mission {

inline constexpr std::size_t kMaxAcfrPoints = 990;  ///< Limit of all legs of one of our missions.

/// Reads the waypoints of the primitive, and a goto's heading, into `leg`; false if they are not
/// known, because of an error that was reported.
[[nodiscard]] bool read_points(AcfrElements& elements, const XmlElement& element, ForeignLeg& leg);

}  // namespace dive::mission
