#pragma once
// The geometry of a picture: what to show of the world, and how it looks from one side. Internal
// to the pictures.

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "mission/record/svg.h"
#include "mission/record/svg_canvas.h"

namespace dive::mission {

/// A parallel view along an axis of W: u to the right, v up. `toward` points at the viewer.
struct Projection {
  int u;
  int v;
  int depth;
  double toward;

  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector3d& p) const { return {p[u], p[v]}; }
};

inline constexpr Projection kFromAbove{0, 1, 2, 1.0};
inline constexpr Projection kFromSouth{0, 2, 1, -1.0};

/// Finite, and no farther away than anything that is worth a picture.
[[nodiscard]] bool drawable(const Eigen::Vector3d& p);

/// Corners of the convex hull, counter-clockwise.
[[nodiscard]] Points2 hull_of(Points2 points);

/// All that is swum or planned, sampled finely enough to ask what it passes under.
[[nodiscard]] std::vector<Eigen::Vector3d> path_samples(const DivePicture& picture);

/// The part of the world to show: all paths and goals, and obstacles as far as they end nearby (a
/// seabed of a square kilometre does not make everything else a dot).
[[nodiscard]] Eigen::AlignedBox3d region_of_interest(const DivePicture& picture);

/// How an obstacle stands to the paths in a view.
enum class Standing {
  kBeside,   ///< The paths do not cross its outline.
  kInFront,  ///< It hides some of a path: a roof from above.
  kBehind,   ///< Paths pass in front of it only: a seabed from above. All, without paths.
};

struct Outline {
  Points2 corners;  ///< m, in the view; clipped to the region where it has no end.
  Standing standing = Standing::kBeside;
};

[[nodiscard]] Outline outline_of(const planning::Obstacle& obstacle, const Projection& view,
                                 const std::vector<Eigen::Vector3d>& paths,
                                 const Eigen::AlignedBox3d& region);

/// What the hull covers on its way from one waypoint to the next, as polygons that overlap.
[[nodiscard]] std::vector<Points2> sweep_of(const std::vector<Pose>& waypoints,
                                            const planning::RobotHull& hull,
                                            const Projection& view);

}  // namespace dive::mission
