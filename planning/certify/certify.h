#pragma once
// The clearance certificate: a lower bound, proved, on the distance between the true hull and the
// world along the whole motion, not at samples. Independent of the optimiser: it shares no
// distance evaluation with it. Its result is what `clearance_m` means everywhere.
//
// Between waypoints the vehicle moves as interpolate() of common/se3.h says. For a unit vector n
// let
//     s_n(X) = min over the body at pose X of n . x  -  max over the obstacle of n . x.
// It never exceeds the signed distance d(X), and equals it for the best n, which FCL finds. Over a
// piece of the motion from X_a to X_b that turns by theta, a body point at radius r from B's origin
// leaves the chord of its n component by at most r theta^2 / 8 (its second derivative is at most
// r theta^2), so on the whole piece
//     d >= (1 - t) s_n(X_a) + t s_n(X_b) - r theta^2 / 8,
// for the n found at either end; the better of the two counts at each t. Pieces are halved until
// the bound is within `tolerance` of the smallest sampled distance. This is adaptive dynamic
// collision checking (Schwarzer, Saha, Latombe 2005) with directions besides distances: its own
// bound, (d_a + d_b - |dp| - theta r) / 2, needs hundreds of pieces to pass along a wall; this
// needs one, because swimming along a wall does not change s_n.

#include <memory>
#include <span>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::planning {

struct CertifyOptions {
  double tolerance = 0.002;      ///< m, gap allowed between the bound and the truth.
  double cutoff = 5.0;           ///< m, clearances beyond it are reported as it.
  int max_evaluations = 20'000;  ///< Of FCL; then the bound reached so far is returned.
};

struct Certificate {
  double clearance_m = 0.0;  ///< Proved lower bound; zero or negative when in collision.
  /// Smallest sampled distance: an upper bound on the true clearance while it is positive. In
  /// collision there is nothing to certify: refining stops, and both are rough depths.
  double nearest_m = 0.0;
  int segment = 0;           ///< Where the smallest distance was found: waypoint index ...
  double fraction = 0.0;     ///< ... and fraction of the way to the next.
  int obstacle = -1;         ///< The nearest obstacle there; -1 when none within the cutoff.
  double highest_z_m = 0.0;  ///< Proved upper bound on z of the hull; the surface, at 0, is not an
                             ///< obstacle.
  int evaluations = 0;       ///< Of FCL.
};

class Certifier {
 public:
  Certifier(const World& world, const RobotHull& hull, CertifyOptions options = {});
  Certifier(Certifier&&) noexcept;
  ~Certifier();

  /// Certifies the motion through `waypoints` (at least one pose X_WB, all finite).
  [[nodiscard]] Certificate certify(std::span<const Pose> waypoints);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
