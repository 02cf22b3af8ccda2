#pragma once
// The clearance certificate: a lower bound, proved, on the distance between the true hull and the
// world along the whole motion, not at samples. Independent of the optimiser: it shares no
// distance evaluation with it. Its result is what `clearance_m` means everywhere.
//
// Between waypoints the vehicle moves as interpolate() of common/se3.h says. A point of the hull
// within radius r of B's origin moves at most |dp| + |dtheta| r over a piece of the motion, so with
// clearances d0, d1 at the ends of the piece, everywhere on it
//     d >= (d0 + d1 - |dp| - |dtheta| r) / 2.
// (Schwarzer, Saha, Latombe 2005, "Adaptive dynamic collision checking".) Pieces are halved until
// the bound is within `tolerance` of the smallest sampled distance.

#include <memory>
#include <span>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::planning {

struct CertifyOptions {
  double tolerance = 0.002;      ///< m, gap allowed between the bound and the truth.
  double cutoff = 5.0;           ///< m, clearances beyond it are reported as it.
  double surface_z = 0.0;        ///< The hull must stay below; not an obstacle.
  int max_evaluations = 20'000;  ///< Then the bound reached so far is returned.
};

struct Certificate {
  double clearance_m = 0.0;  ///< Proved lower bound; negative when in collision.
  double nearest_m = 0.0;    ///< Smallest sampled distance: an upper bound on the true clearance.
  int segment = 0;           ///< Where the smallest distance was found: waypoint index ...
  double fraction = 0.0;     ///< ... and fraction of the way to the next.
  int obstacle = -1;         ///< The nearest obstacle there; -1 when none within the cutoff.
  int evaluations = 0;
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
