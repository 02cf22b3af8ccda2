#pragma once
// The clearance certificate: a proved lower bound on the distance between the true hull and the
// world along the whole motion, not only at samples. `clearance_m` means this bound everywhere.
//
// It shares the world and interpolate() with the optimiser. Directions n come from FCL's GJK, which
// the optimiser does not use, from the axes of the obstacle, and from earlier queries. FCL proves
// nothing: the bound is computed here, from vertices and closed-form support functions that the
// optimiser does not use, and it holds for any n. A wrong n can only lower the bound.
//
// Between waypoints the vehicle moves as defined by interpolate() of common/se3.h. For a unit
// vector n let
//     s_n(X) = min over the body at pose X of n . x  -  max over the obstacle of n . x.
// s_n never exceeds the signed distance d(X), and equals it for the best n, which FCL searches for.
// On a piece of the motion from X_a to X_b that turns by theta, the n component of a body point at
// radius r from B's origin deviates from its chord by at most r theta^2 / 8 (its second derivative
// is at most r theta^2), so on the whole piece
//     d >= (1 - t) s_n(X_a) + t s_n(X_b) - r theta^2 / 8,
// for the n found at either end; the better of the two counts at each t. Pieces are halved until
// the bound is within `tolerance` of the smallest sampled distance. This is adaptive dynamic
// collision checking (Schwarzer, Saha, Latombe 2005) with directions in addition to distances: its
// own bound, (d_a + d_b - |dp| - theta r) / 2, needs hundreds of pieces along a wall; this one
// needs a single piece, because swimming along a wall does not change s_n.

#include <memory>
#include <span>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::planning {

struct CertifyOptions {
  double tolerance = 0.002;  ///< Allowed gap between the bound and the true distance, m.
  double cutoff = 5.0;       ///< Largest clearance reported, m.
  /// Limit of FCL queries; at the limit the bound reached so far is returned.
  int max_evaluations = 20'000;
};

struct Certificate {
  double clearance_m = 0.0;  ///< Proved lower bound; zero or negative when in collision.
  /// Smallest sampled distance from FCL, m: an upper bound on the true clearance while it is
  /// positive and FCL is right. In a collision refinement stops, and both values are rough depths.
  double nearest_m = 0.0;
  int segment = 0;  ///< Waypoint index before the smallest distance.
  /// Position of the smallest distance between that waypoint and the next, 0 to 1.
  double fraction = 0.0;
  int obstacle = -1;         ///< Nearest obstacle there; -1 if none is within the cutoff.
  double highest_z_m = 0.0;  ///< Proved upper bound on z of the hull; the surface, at 0, is not an
                             ///< obstacle.
  int evaluations = 0;       ///< Number of FCL queries.
};

class Certifier {
 public:
  Certifier(const World& world, const RobotHull& hull, CertifyOptions options = {});
  Certifier(Certifier&&) noexcept;
  ~Certifier();

  /// Replaces the world and options. Much cheaper than a new certifier, which has to compute the
  /// convex hull of the vehicle.
  void reset(const World& world, const CertifyOptions& options);

  /// Certifies the motion through `waypoints` (at least one pose X_WB, all finite).
  [[nodiscard]] Certificate certify(std::span<const Pose> waypoints);
  /// Certifies with another cutoff (m): obstacles beyond it cost little. Near the clearance `asked`
  /// (m) the bound is finer, so that a motion that keeps it is not rejected because of the
  /// tolerance.
  [[nodiscard]] Certificate certify(std::span<const Pose> waypoints, double cutoff, double asked);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
