#include "planning/map_matching/map_matcher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "common/assert.h"
#include "planning/map_matching/map_agreement.h"
#include "planning/map_matching/scan_limits.h"

namespace dive::planning {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kFixRays = 440;   // of a scan
constexpr int kMinUsed = 40;            // points on mapped surfaces
constexpr double kSurfaceSigma = 0.02;  // m: a wall that is not where it was drawn
constexpr double kAngleSigma = 0.004;   // rad, of a ray
constexpr double kTiltSigma = 0.008;    // rad, about each level axis: attitude, and the mounting
constexpr double kHeightSigma = 0.1;    // m, of the map relative to the depth sensor
constexpr double kNoHeight = 10.0;      // m, one sigma: nothing is known of the height
constexpr double kIndependent = 0.05;   // kappa: errors of neighbouring rays are correlated
constexpr double kHuber = 1.5;          // sigmas
constexpr double kOutlier = 9.0;        // squared sigmas: the most that one point can cost
constexpr double kLargest = 16.0;       // squared sigmas of a point, for the variance
constexpr double kMinGate = 0.15;       // m
constexpr double kMaxGate = 0.6;        // m
constexpr double kMayFace = -0.15;      // n . d of a surface that a ray can have met
constexpr double kThinPlate = 0.12;     // m towards the lens, where its near side is looked for
constexpr double kWaveHeight = -0.05;   // m: a point above is a wave or a reflection
constexpr double kMinPrior = 0.02;      // m and rad: the search begins with at least this
constexpr int kIterations = 4;
constexpr double kConverged = 1e-3;       // m and rad
constexpr double kWorthSearch = 0.08;     // m, one sigma: below, no other minimum is within reach
constexpr double kSearch = 3.0;           // sigmas around the prior
constexpr double kMinSearch = 0.7;        // m around the prior
constexpr double kMaxSearch = 3.0;        // m around the prior
constexpr double kGridStep = 0.25;        // m between places that are tried
constexpr std::size_t kMaxPlaces = 200;   // that are tried: the step grows beyond
constexpr std::size_t kCandidates = 6;    // places from which a minimum is sought
constexpr std::size_t kCoarseStride = 4;  // of the rays, where a place is tried
constexpr double kCoarseReach = 0.5;      // m: a point farther from any surface is an outlier
constexpr double kSamePlace = 0.12;       // m between two minima that are one
constexpr double kAmbiguous = 0.02;       // of the best likelihood
constexpr double kTooUncertain = 0.4;     // m, one sigma: no contradiction of the map is certain
constexpr double kGoodPosition = 0.1;     // m, one sigma: good enough to tell what is gone
constexpr int kConfirmed = 3;             // places of a scan that may tell it
constexpr double kDoubt = 0.25;           // share of a prior that may be half as good as it says

// Order of a shift: position (m), heading, and tilt about x and y of W (rad).
constexpr int kZ = 2;
constexpr int kYaw = 3;
constexpr int kTilt = 4;
// What a fix is about, and what is marginalised.
constexpr std::array kKept = {0, 1, kYaw};
constexpr std::array kNuisance = {kZ, kTilt, kTilt + 1};

Eigen::Quaterniond turn_of(const Vector6d& shift) {
  return so3_exp(Vector3d(shift[kTilt], shift[kTilt + 1], shift[kYaw]));
}

struct MatchedRay {
  Vector3d arm_W;        // from B's origin to the point, turned to W
  Vector3d direction_W;  // unit, from the lens
  double range;          // m
};

// A linearisation around a shift of the prior, and its robust cost.
struct Normal {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;
  double squares = 0.0;  // weighted sum over the used points of their squared residuals, in sigmas
  double weights = 0.0;  // its weights
  int used = 0;
  int gated = 0;

  // The variance of unit weight.
  [[nodiscard]] double excess() const {
    return weights > 0.0 ? std::max(1.0, squares / weights) : 1.0;
  }
};

struct Minimum {
  Vector6d shift = Vector6d::Zero();  // from the prior
  Normal at;
  double from_prior = 0.0;  // squared Mahalanobis distance from the prior

  [[nodiscard]] double cost() const { return at.cost + from_prior; }
  // With the residuals that were found instead of those that were expected.
  [[nodiscard]] Minimum reweighted() const {
    Minimum result = *this;
    result.at.information /= at.excess();
    result.at.gradient /= at.excess();
    return result;
  }
};

std::vector<MatchedRay> matched_rays(const RangeScan& scan, const Pose& X_WB) {
  std::vector<MatchedRay> rays;
  const Matrix3d R_WB = X_WB.q.toRotationMatrix();
  const Vector3d origin_B = scan.origin_B.cast<double>();
  const std::size_t stride = std::max<std::size_t>(1, scan.points_B.size() / kFixRays);
  for (std::size_t i = stride / 2; i < scan.points_B.size(); i += stride) {
    const Vector3d b = scan.points_B[i].cast<double>();
    const Vector3d along_B = b - origin_B;
    const double range = along_B.norm();
    if (!(range >= kMinRange && range <= static_cast<double>(scan.reach))) continue;
    const Vector3d arm_W = R_WB * b;
    if (X_WB.p.z() + arm_W.z() > kWaveHeight) continue;
    rays.push_back({arm_W, R_WB * along_B / range, range});
  }
  return rays;
}

// The covariance of a shift, from that of x, y and heading.
Matrix6d with_nuisance(const Matrix3d& prior, double height_sigma_m) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner<2, 2>() = prior.topLeftCorner<2, 2>();
  covariance.block<2, 1>(0, kYaw) = prior.block<2, 1>(0, 2);
  covariance.block<1, 2>(kYaw, 0) = prior.block<1, 2>(2, 0);
  const double height_sigma = std::max(kHeightSigma, height_sigma_m);
  covariance(kZ, kZ) = height_sigma * height_sigma;
  covariance(kYaw, kYaw) = prior(2, 2) + 0.25 * kMinPrior * kMinPrior;
  covariance.diagonal().head<2>().array() += kMinPrior * kMinPrior;
  covariance.diagonal().tail<2>().setConstant(kTiltSigma * kTiltSigma);
  return covariance;
}

// The scan is compared where it fits best, so that an error of the position is no contradiction.
void place_at(const Minimum& best, const Pose& X_WB, const Matrix6d& prior, MatchedScan& placed) {
  placed.X_WB = X_WB;
  Matrix6d covariance = prior;
  if (best.at.used >= kMinUsed) {
    covariance = (best.at.information + prior.inverse()).inverse();
    placed.X_WB.p += best.shift.head<3>();
    placed.X_WB.q = turn_of(best.shift) * X_WB.q;
  }
  placed.sigma_m =
      std::sqrt(std::max(covariance(0, 0), covariance(1, 1)) + std::abs(covariance(0, 1)));
}

// Of the height by the scan alone, with position and heading from the prior; 0: not constrained.
double height_sigma_of(const Minimum& best, const Matrix6d& covariance) {
  Matrix6d others = covariance;
  others(kZ, kZ) = kNoHeight * kNoHeight;
  const Matrix6d posterior = (best.at.information + others.inverse()).inverse();
  const double sigma = std::sqrt(std::max(posterior(kZ, kZ), 0.0));
  return sigma < 0.5 * kNoHeight ? sigma : 0.0;
}

// Leaves position and heading: an error of height or tilt that is the same for all rays must not
// pass for information about them where the ground slopes.
void marginalise(const Minimum& best, const Matrix6d& covariance, MapFix& fix) {
  Matrix3d cross;
  Matrix3d nuisance;
  Vector3d gradient;
  for (int row = 0; row < 3; ++row) {
    const int i = kNuisance[static_cast<std::size_t>(row)];
    const double prior = 1.0 / covariance(i, i);
    gradient[row] = best.at.gradient[i] - prior * best.shift[i];
    for (int column = 0; column < 3; ++column) {
      nuisance(row, column) = best.at.information(i, kNuisance[static_cast<std::size_t>(column)]);
      cross(column, row) = best.at.information(kKept[static_cast<std::size_t>(column)], i);
    }
    nuisance(row, row) += prior;
  }
  const Matrix3d share = cross * nuisance.inverse();
  for (int row = 0; row < 3; ++row) {
    const int i = kKept[static_cast<std::size_t>(row)];
    fix.gradient[row] = best.at.gradient[i];
    for (int column = 0; column < 3; ++column) {
      fix.information(row, column) =
          best.at.information(i, kKept[static_cast<std::size_t>(column)]);
    }
  }
  fix.gradient -= share * gradient;
  fix.information -= share * cross.transpose();
  fix.information = 0.5 * (fix.information + fix.information.transpose()).eval();
}

}  // namespace

struct MapMatcher::Impl {
  Impl(std::shared_ptr<const MapSurface> surface_in, const RangeNoise& noise_in)
      : surface(std::move(surface_in)), noise(noise_in) {
    DIVE_DEMAND(surface);
  }

  // The surface that a ray can have met near x.
  [[nodiscard]] std::optional<MapSurface::Nearest> met(const MatchedRay& ray, const Vector3d& x,
                                                       const Vector3d& direction,
                                                       double reach) const {
    const Vector3d from = x - ray.range * direction;
    std::optional<MapSurface::Nearest> nearest = surface->nearest(x, from, reach);
    if (nearest && nearest->normal_W.dot(direction) <= kMayFace) return nearest;
    // Behind a thin plate the nearest surface is its far side.
    nearest = surface->nearest(x - kThinPlate * direction, from, reach);
    if (!nearest) return std::nullopt;
    const double along = nearest->normal_W.dot(direction);
    if (along > kMayFace) return std::nullopt;
    nearest->height += kThinPlate * along;
    return nearest;
  }

  [[nodiscard]] Normal linearise(const std::vector<MatchedRay>& rays, const Vector3d& p_W,
                                 const Vector6d& shift, const Matrix6d& covariance) const {
    Normal normal;
    const Matrix3d turn = turn_of(shift).toRotationMatrix();
    for (const MatchedRay& ray : rays) {
      const Vector3d arm = turn * ray.arm_W;
      const Vector3d direction = turn * ray.direction_W;
      const Vector3d x = p_W + shift.head<3>() + arm;
      const auto nearest = met(ray, x, direction, kMaxGate);
      if (!nearest) {
        ++normal.gated;
        normal.cost += kIndependent * kOutlier;
        continue;
      }
      const Vector3d& n = nearest->normal_W;
      const Vector3d by_turn = arm.cross(n);
      Vector6d h;
      h << n, by_turn.z(), by_turn.x(), by_turn.y();
      const double range_sigma = noise.sigma(ray.range) * n.dot(direction);
      const double variance = range_sigma * range_sigma + kSurfaceSigma * kSurfaceSigma +
                              std::pow(kAngleSigma * ray.range, 2);
      const double r = nearest->height;
      const double gate =
          std::clamp(3.0 * std::sqrt(h.dot(covariance * h) + variance), kMinGate, kMaxGate);
      const double sigmas = std::abs(r) / std::sqrt(variance);
      normal.cost += kIndependent * std::min(sigmas * sigmas, kOutlier);
      if (std::abs(r) > gate) {
        ++normal.gated;
        continue;
      }
      const double weight = kIndependent * std::min(1.0, kHuber / sigmas) / variance;
      normal.information += weight * h * h.transpose();
      normal.gradient -= weight * r * h;
      const double horizontal = n.head<2>().squaredNorm();
      normal.squares += horizontal * std::min(sigmas * sigmas, kLargest);
      normal.weights += horizontal;
      ++normal.used;
    }
    return normal;
  }

  // Gauss-Newton steps from `shift`, with the prior around zero.
  [[nodiscard]] Minimum descend(const std::vector<MatchedRay>& rays, const Vector3d& p_W,
                                Vector6d shift, const Matrix6d& covariance) const {
    const Matrix6d prior = covariance.inverse();
    Normal normal = linearise(rays, p_W, shift, covariance);
    for (int i = 0; i < kIterations && normal.used >= kMinUsed; ++i) {
      const Vector6d step =
          (normal.information + prior).ldlt().solve(normal.gradient - prior * shift);
      shift += step;
      normal = linearise(rays, p_W, shift, covariance);
      if (step.cwiseAbs().maxCoeff() < kConverged) break;
    }
    return {shift, normal, shift.dot(prior * shift)};
  }

  // How badly the scan fits at a place: the squared distances from the mapped surfaces, m^2.
  [[nodiscard]] double misfit(const std::vector<MatchedRay>& rays, const Vector3d& at_W) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < rays.size(); i += kCoarseStride) {
      const Vector3d x = at_W + rays[i].arm_W;
      const auto nearest = met(rays[i], x, rays[i].direction_W, kCoarseReach);
      const double height =
          nearest ? std::min(std::abs(nearest->height), kCoarseReach) : kCoarseReach;
      sum += height * height;
    }
    return sum;
  }

  // The places around the prior where the scan fits best, no two within a step of the grid.
  [[nodiscard]] std::vector<Eigen::Vector2d> candidates(const std::vector<MatchedRay>& rays,
                                                        const Vector3d& p_W,
                                                        const Matrix6d& covariance) const {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(covariance.topLeftCorner<2, 2>());
    const Eigen::Vector2d reach = (kSearch * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt())
                                      .cwiseMax(kMinSearch)
                                      .cwiseMin(kMaxSearch);
    const double area = std::numbers::pi * reach.x() * reach.y();
    const double step = std::max(kGridStep, std::sqrt(area / static_cast<double>(kMaxPlaces)));
    struct Place {
      Eigen::Vector2d shift;
      double misfit;
    };
    std::vector<Place> places;
    const int columns = static_cast<int>(reach.x() / step);
    const int rows = static_cast<int>(reach.y() / step);
    for (int i = -columns; i <= columns; ++i) {
      for (int k = -rows; k <= rows; ++k) {
        const Eigen::Vector2d along(i * step, k * step);
        if (along.cwiseQuotient(reach).norm() > 1.0) continue;
        const Eigen::Vector2d shift = axes.eigenvectors() * along;
        places.push_back({shift, misfit(rays, p_W + Vector3d(shift.x(), shift.y(), 0.0))});
      }
    }
    std::ranges::sort(places, {}, &Place::misfit);
    std::vector<Eigen::Vector2d> best;
    for (const Place& place : places) {
      if (best.size() == kCandidates) break;
      const bool is_new = std::ranges::all_of(best, [&](const Eigen::Vector2d& other) {
        return (place.shift - other).norm() > 1.01 * step;
      });
      if (is_new) best.push_back(place.shift);
    }
    return best;
  }

  struct Found {
    Minimum best;
    Minimum nearest;         // to the prior
    double ambiguity = 0.0;  // likelihood of another minimum relative to the best
  };

  // The best minimum from the prior and from places around it.
  [[nodiscard]] Found search(const std::vector<MatchedRay>& rays, const Vector3d& p_W,
                             const Matrix6d& covariance, bool is_tracked) const {
    const Minimum nearest = descend(rays, p_W, Vector6d::Zero(), covariance);
    Minimum best = nearest;
    const double variance =
        std::max(covariance(0, 0), covariance(1, 1)) + std::abs(covariance(0, 1));
    if (variance < kWorthSearch * kWorthSearch) return {best, nearest};
    std::vector<Minimum> minima = {best};
    for (const Eigen::Vector2d& place : candidates(rays, p_W, covariance)) {
      Vector6d from = Vector6d::Zero();
      from.head<2>() = place;
      minima.push_back(descend(rays, p_W, from, covariance));
    }
    const auto usable = [](const Minimum& minimum) { return minimum.at.used >= kMinUsed; };
    for (const Minimum& one : minima) {
      if (usable(one) && (!usable(best) || one.cost() < best.cost())) best = one;
    }
    double ambiguity = 0.0;
    const double share = is_tracked ? 1.0 : kDoubt;
    for (const Minimum& one : minima) {
      const double apart = (one.shift - best.shift).head<2>().norm();
      if (!usable(one) || apart < kSamePlace) continue;
      const double worse = (one.at.cost - best.at.cost) / best.at.excess() +
                           share * (one.from_prior - best.from_prior);
      ambiguity = std::max(ambiguity, std::min(1.0, std::exp(-0.5 * worse)));
    }
    return {best, nearest, ambiguity};
  }

  [[nodiscard]] MatchedScan place(const RangeScan& scan, const PosePrior& prior) const {
    const Vector3d& p_W = prior.X_WB.p;
    MatchedScan placed;
    MapFix& fix = placed.fix;
    fix.scan_utime = scan.utime;
    fix.position_W = p_W.head<2>();
    fix.heading_correction = prior.heading_correction;
    const std::vector<MatchedRay> rays = matched_rays(scan, prior.X_WB);
    const Matrix6d covariance = with_nuisance(prior.covariance, prior.height_sigma_m);
    const Found found = search(rays, p_W, covariance, prior.is_tracked);
    fix.ambiguity = found.ambiguity;
    Minimum best = found.best.reweighted();
    fix.used = best.at.used;
    fix.gated = best.at.gated;
    place_at(best, prior.X_WB, covariance, placed);
    if (placed.sigma_m <= kTooUncertain) {
      fix.agreement = agreement(*surface, scan, placed.X_WB, placed.sigma_m);
    }
    if (best.at.used < kMinUsed) {
      fix.problem = MapFixProblem::kFewPoints;
      return placed;
    }
    if (fix.ambiguity > kAmbiguous) {
      fix.problem = MapFixProblem::kAmbiguous;
      if (found.nearest.at.used < kMinUsed) return placed;
      best = found.nearest.reweighted();
    }
    fix.position_W += best.shift.head<2>();
    fix.heading_correction = wrap_angle(fix.heading_correction + best.shift[kYaw]);
    marginalise(best, covariance, fix);
    fix.height_W = p_W.z() + best.shift[kZ];
    fix.height_sigma_m = height_sigma_of(best, covariance);
    return placed;
  }

  [[nodiscard]] Matrix3d expected_information(const RangeScan& scan, const Pose& X_WB) const {
    const Matrix6d covariance = with_nuisance(Matrix3d::Zero(), 0.0);
    Minimum there;
    there.at = linearise(matched_rays(scan, X_WB), X_WB.p, there.shift, covariance);
    MapFix fix;
    if (there.at.used >= kMinUsed) marginalise(there, covariance, fix);
    return fix.information;
  }

  std::shared_ptr<const MapSurface> surface;
  RangeNoise noise;
};

MapMatcher::MapMatcher(const World& world, const RangeNoise& noise)
    : MapMatcher(std::make_shared<const MapSurface>(world), noise) {}
MapMatcher::MapMatcher(std::shared_ptr<const MapSurface> surface, const RangeNoise& noise)
    : impl_(std::make_unique<Impl>(std::move(surface), noise)) {}
MapMatcher::MapMatcher(MapMatcher&&) noexcept = default;
MapMatcher& MapMatcher::operator=(MapMatcher&&) noexcept = default;
MapMatcher::~MapMatcher() = default;

MatchedScan MapMatcher::place(const RangeScan& scan, const PosePrior& prior) const {
  DIVE_DEMAND(prior.X_WB.is_finite() && prior.covariance.allFinite() &&
              prior.covariance.diagonal().minCoeff() >= 0.0);
  return impl_->place(scan, prior);
}

bool MatchedScan::may_show_absence() const {
  const MapAgreement& seen = fix.agreement;
  return fix.problem == MapFixProblem::kNone && sigma_m <= kGoodPosition &&
         seen.confirmed >= kConfirmed && !seen.contradicts();
}

Matrix3d MapMatcher::expected_information(const RangeScan& scan, const Pose& X_WB) const {
  DIVE_DEMAND(X_WB.is_finite());
  return impl_->expected_information(scan, X_WB);
}

}  // namespace dive::planning
