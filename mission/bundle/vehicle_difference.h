#pragma once
// Whether a bundle was made for this vehicle.

#include <string>

#include "vehicle/model.h"

namespace dive::mission {

/// What differs between the vehicle for which a mission was checked and the one that is to dive it,
/// as a clause with both values: "its hull is 0.72 x 0.62 x 0.17 m, this one's ...". Empty if the
/// descriptions mean the same, however they are written.
[[nodiscard]] std::string vehicle_difference(const vehicle::Model& checked,
                                             const vehicle::Model& here);

}  // namespace dive::mission
