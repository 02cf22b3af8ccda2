#include "planning/map_matching/map_matcher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "common/assert.h"
#include "planning/map_matching/map_agreement.h"
#include "planning/map_matching/scan_fit.h"

namespace dive::planning {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kTiltSigma = 0.008;   // rad, about each level axis: attitude, and the mounting
constexpr double kHeightSigma = 0.1;   // m, of the map relative to the depth sensor
constexpr double kNoHeight = 10.0;     // m, one sigma: nothing is known of the height
constexpr double kMinPrior = 0.02;     // m and rad: the search begins with at least this
constexpr double kAmbiguous = 0.02;    // of the best likelihood
constexpr double kTooUncertain = 0.4;  // m, one sigma: no contradiction of the map is certain
constexpr double kGoodPosition = 0.1;  // m, one sigma: good enough to tell what is gone
constexpr int kConfirmed = 3;          // places of a scan that may tell it

// What a fix is about, and what is marginalised.
constexpr std::array kKept = {0, 1, kShiftYaw};
constexpr std::array kNuisance = {kShiftZ, kShiftTilt, kShiftTilt + 1};

}  // namespace

struct MapMatcher::Impl {
  Impl(std::shared_ptr<const MapSurface> surface_in, const RangeNoise& noise_in)
      : surface(std::move(surface_in)), noise(noise_in) {
    DIVE_DEMAND(surface);
  }

  // The covariance of a shift, from that of x, y and heading.
  static Matrix6d with_nuisance(const Matrix3d& prior, double height_sigma_m) {
    Matrix6d covariance = Matrix6d::Zero();
    covariance.topLeftCorner<2, 2>() = prior.topLeftCorner<2, 2>();
    covariance.block<2, 1>(0, kShiftYaw) = prior.block<2, 1>(0, 2);
    covariance.block<1, 2>(kShiftYaw, 0) = prior.block<1, 2>(2, 0);
    const double height_sigma = std::max(kHeightSigma, height_sigma_m);
    covariance(kShiftZ, kShiftZ) = height_sigma * height_sigma;
    covariance(kShiftYaw, kShiftYaw) = prior(2, 2) + 0.25 * kMinPrior * kMinPrior;
    covariance.diagonal().head<2>().array() += kMinPrior * kMinPrior;
    covariance.diagonal().tail<2>().setConstant(kTiltSigma * kTiltSigma);
    return covariance;
  }

  [[nodiscard]] MatchedScan place(const RangeScan& scan, const PosePrior& prior,
                                  PlaceSearch& search) const {
    const Vector3d& p_W = prior.X_WB.p;
    MatchedScan placed;
    MapFix& fix = placed.fix;
    fix.scan_utime = scan.utime;
    fix.position_W = p_W.head<2>();
    fix.heading_correction = prior.heading_correction;
    const Matrix6d covariance = with_nuisance(prior.covariance, prior.height_sigma_m);
    const PlaceSearch::Result found =
        search.search(ScanFit(*surface, noise, scan, prior.X_WB), prior, covariance);
    fix.ambiguity = found.ambiguity;
    FitMinimum best = found.best.reweighted();
    fix.used = best.at.used;
    fix.gated = best.at.gated;
    place_at(best, prior.X_WB, covariance, placed);
    if (placed.sigma_m <= kTooUncertain) {
      fix.agreement = agreement(*surface, scan, placed.X_WB, placed.sigma_m);
    }
    if (!best.is_usable()) {
      fix.problem = MapFixProblem::kFewPoints;
      return placed;
    }
    if (fix.ambiguity > kAmbiguous) {
      fix.problem = MapFixProblem::kAmbiguous;
      if (!found.is_continued) return placed;
      best = found.followed.reweighted();
    }
    fix.position_W += best.shift.head<2>();
    fix.heading_correction = wrap_angle(fix.heading_correction + best.shift[kShiftYaw]);
    marginalise(best, covariance, fix);
    fix.height_W = p_W.z() + best.shift[kShiftZ];
    fix.height_sigma_m = height_sigma_of(best, covariance);
    return placed;
  }

  [[nodiscard]] Matrix3d expected_information(const RangeScan& scan, const Pose& X_WB) const {
    const Matrix6d covariance = with_nuisance(Matrix3d::Zero(), 0.0);
    FitMinimum there;
    there.at = ScanFit(*surface, noise, scan, X_WB).linearise(there.shift, covariance);
    MapFix fix;
    if (there.is_usable()) marginalise(there, covariance, fix);
    return fix.information;
  }

  // The scan is compared where it fits best, so that an error of the position is no contradiction.
  static void place_at(const FitMinimum& best, const Pose& X_WB, const Matrix6d& prior,
                       MatchedScan& placed) {
    placed.X_WB = X_WB;
    Matrix6d covariance = prior;
    if (best.is_usable()) {
      covariance = (best.at.information + prior.inverse()).inverse();
      placed.X_WB.p += best.shift.head<3>();
      placed.X_WB.q = turn_of(best.shift) * X_WB.q;
    }
    placed.sigma_m = std::sqrt(widest_variance(covariance));
  }

  // Of the height by the scan alone, with position and heading from the prior; 0: not constrained.
  static double height_sigma_of(const FitMinimum& best, const Matrix6d& covariance) {
    Matrix6d others = covariance;
    others(kShiftZ, kShiftZ) = kNoHeight * kNoHeight;
    const Matrix6d posterior = (best.at.information + others.inverse()).inverse();
    const double sigma = std::sqrt(std::max(posterior(kShiftZ, kShiftZ), 0.0));
    return sigma < 0.5 * kNoHeight ? sigma : 0.0;
  }

  // Leaves position and heading: an error of height or tilt that is the same for all rays must not
  // pass for information about them where the ground slopes.
  static void marginalise(const FitMinimum& best, const Matrix6d& covariance, MapFix& fix) {
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

MatchedScan MapMatcher::place(const RangeScan& scan, const PosePrior& prior,
                              PlaceSearch& search) const {
  DIVE_DEMAND(prior.X_WB.is_finite() && prior.covariance.allFinite() &&
              prior.covariance.diagonal().minCoeff() >= 0.0 && prior.odometry_O.allFinite());
  return impl_->place(scan, prior, search);
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
