#pragma once
// The world's shapes as closed triangle surfaces, for the simulator's ground truth.

#include "planning/world/world.h"
#include "vehicle/convex_hull.h"

namespace dive::vehicle {

/// A solid that contains the shape, in the shape's own frame: a box exactly, curved shapes with
/// facets that touch them from outside, so that a clearance is never overstated. It is understated
/// by at most 0.5 % of the largest radius, of a polytope by 0.8 of its radius. Demands a bounded
/// shape (no half-space) that is not flat.
[[nodiscard]] TriangleSolid circumscribed_solid(const planning::Shape& shape);

}  // namespace dive::vehicle
