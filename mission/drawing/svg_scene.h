#pragma once
// The geometry of a drawing: the part of the world to show, and its projections. Internal to
// mission/drawing.

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "mission/drawing/svg.h"
#include "mission/drawing/svg_canvas.h"

namespace dive::mission {

/// A parallel projection along an axis of W: u to the right, v up. `toward` points at the viewer.
struct Projection {
  int u;
  int v;
  int depth;
  double toward;

  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector3d& p) const { return {p[u], p[v]}; }
};

inline constexpr Projection kFromAbove{0, 1, 2, 1.0};
inline constexpr Projection kFromSouth{0, 2, 1, -1.0};

/// True for a finite point within the largest distance that is drawn.
[[nodiscard]] bool drawable(const Eigen::Vector3d& p);

/// Corners of the convex hull, counter-clockwise.
[[nodiscard]] Points2 hull_of(Points2 points);

/// All swum or planned paths, sampled finely enough to find what they pass under.
[[nodiscard]] std::vector<Eigen::Vector3d> path_samples(const DiveDrawing& drawing);

/// The part of the world to show: all paths and goals, and obstacles that end nearby (so that a
/// seabed of a square kilometre does not shrink everything else to a dot).
[[nodiscard]] Eigen::AlignedBox3d region_of_interest(const DiveDrawing& drawing);

/// The position of an obstacle relative to the paths in a view.
enum class Standing {
  kBeside,   ///< The paths do not cross its outline.
  kInFront,  ///< It hides a part of a path: an overhead seen from above.
  /// Paths only pass in front of it: a seabed from above. All obstacles if there are no paths.
  kBehind,
};

struct Outline {
  Points2 corners;  ///< m, in the view; clipped to the region if unbounded.
  Standing standing = Standing::kBeside;
};

[[nodiscard]] Outline outline_of(const planning::Obstacle& obstacle, const Projection& view,
                                 const std::vector<Eigen::Vector3d>& paths,
                                 const Eigen::AlignedBox3d& region);

/// The swept hull between consecutive waypoints, as overlapping polygons.
[[nodiscard]] std::vector<Points2> sweep_of(const std::vector<Pose>& waypoints,
                                            const planning::RobotHull& hull,
                                            const Projection& view);

}  // namespace dive::mission
