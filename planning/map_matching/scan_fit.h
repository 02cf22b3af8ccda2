#pragma once
// The misfit between one range scan and the known map at a pose, its linearisation, and the nearest
// minimum: iterated point-to-plane, as map_matcher.h describes it.

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/range_noise.h"
#include "common/range_scan.h"
#include "common/se3.h"
#include "planning/map_matching/map_surface.h"

namespace dive::planning {

/// Order of a shift of the pose: position (m), heading, and tilt about x and y of W (rad).
inline constexpr int kShiftZ = 2;
inline constexpr int kShiftYaw = 3;
inline constexpr int kShiftTilt = 4;

/// A linearisation around a shift of the prior pose, and its robust cost.
struct FitNormal {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;
  double squares = 0.0;  ///< Weighted sum over the used points of their squared residuals, sigmas.
  double weights = 0.0;  ///< Its weights.
  int used = 0;
  int gated = 0;

  /// The variance of unit weight, at least 1.
  [[nodiscard]] double excess() const;
};

struct FitMinimum {
  static constexpr int kMinUsed = 40;  ///< Points on mapped surfaces without which it says nothing.

  Vector6d shift = Vector6d::Zero();  ///< From the prior.
  FitNormal at;

  [[nodiscard]] bool is_usable() const { return at.used >= kMinUsed; }
  /// With the residuals that were found instead of those that were expected.
  [[nodiscard]] FitMinimum reweighted() const;
};

[[nodiscard]] Eigen::Quaterniond turn_of(const Vector6d& shift);

/// Variance of the horizontal position along its worst direction, at most, m^2.
[[nodiscard]] double widest_variance(const Matrix6d& covariance);

/// One scan, turned to W by the attitude of a prior pose. Refers to the surface.
///
/// Of thousands of points some hundreds are used. Where nearly all of them lie on level ground,
/// which says nothing of the position, the others are sampled up to three times as densely (as in
/// normal-space sampling, Rusinkiewicz, Levoy 2001), and count as much more where places are
/// compared: a pipe that is seen at two metres must not be outvoted by the floor.
class ScanFit {
 public:
  ScanFit(const MapSurface& surface, const RangeNoise& noise, const RangeScan& scan,
          const Pose& X_WB);

  /// The gates depend on the covariance of the shift.
  [[nodiscard]] FitNormal linearise(const Vector6d& shift, const Matrix6d& covariance) const;
  /// Gauss-Newton steps from a shift, with a prior of the shift: its mean and covariance.
  [[nodiscard]] FitMinimum descend(const Vector6d& from, const Vector6d& mean,
                                   const Matrix6d& covariance) const;
  /// The same to about a centimetre by a quarter of the rays, each of which counts as four: where
  /// a descent should begin, and whether it is worth one.
  [[nodiscard]] FitMinimum approach(const Vector6d& from, const Vector6d& mean,
                                    const Matrix6d& covariance) const;
  /// How badly a part of the scan fits at a horizontal shift (m) of the pose: the squared distances
  /// from the mapped surfaces, m^2.
  [[nodiscard]] double misfit(const Eigen::Vector2d& shift) const;

 private:
  // As how many points one counts.
  struct Worth {
    double information;
    double evidence;  // where places are compared
  };
  struct Ray {
    Eigen::Vector3d arm_W;        // from B's origin to the point, turned to W
    Eigen::Vector3d direction_W;  // unit, from the lens
    double range;                 // m
    Worth worth;
  };

  // Uses every `stride`-th of the points.
  void sample(const RangeScan& scan, const Eigen::Matrix3d& R_WB,
              const std::vector<std::size_t>& points, double stride, const Worth& worth);

  // Of every `stride`-th ray, each of which counts as so many.
  [[nodiscard]] FitNormal linearise_every(int stride, const Vector6d& shift,
                                          const Matrix6d& covariance) const;
  [[nodiscard]] FitMinimum descend_by(int stride, double converged, const Vector6d& from,
                                      const Vector6d& mean, const Matrix6d& covariance) const;

  [[nodiscard]] std::optional<MapSurface::Nearest> met(const Ray& ray, const Eigen::Vector3d& x,
                                                       const Eigen::Vector3d& direction,
                                                       double reach) const;

  const MapSurface& surface_;
  RangeNoise noise_;
  Eigen::Vector3d p_W_;
  std::vector<Ray> rays_;
};

}  // namespace dive::planning
