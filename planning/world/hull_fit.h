#pragma once
// The proof that a convex piece stays near the surface that it represents.

#include "planning/world/triangle_soup.h"
#include "planning/world/world.h"

namespace dive::planning {

/// True if every point of the piece, its radius included, is within `tolerance` (m) of the surface.
/// It is a proof, so some pieces that just fit are refused. The piece is projected along its
/// thinnest axis. Where triangles cover the projection, its height above them is bounded: the gap
/// between a facet's plane and a triangle's is linear, and largest at a corner of their common
/// region. Small or uncovered regions are left to branch and bound with boxes, because the distance
/// to one triangle is convex: a box is near it if its corners are.
[[nodiscard]] bool fits_surface(const Polytope& piece, const TriangleSoup& soup, double tolerance);

}  // namespace dive::planning
