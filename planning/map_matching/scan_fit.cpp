#include "planning/map_matching/scan_fit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "planning/map_matching/scan_limits.h"

namespace dive::planning {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kFixRays = 440.0;  // of a scan
constexpr double kLevelBin = 0.1;   // m of height
constexpr double kFewOthers = 0.3;  // share of the points: where fewer are not level
constexpr double kMostBoost = 3.0;
constexpr double kSurfaceSigma = 0.02;  // m: a wall that is not where it was drawn
constexpr double kAngleSigma = 0.004;   // rad, of a ray
constexpr double kIndependent = 0.05;   // kappa: errors of neighbouring rays are correlated
constexpr double kHuber = 1.5;          // sigmas
constexpr double kOutlier = 9.0;        // squared sigmas: the most that one point can cost
constexpr double kLargest = 16.0;       // squared sigmas of a point, for the variance
constexpr double kMinGate = 0.15;       // m
constexpr double kMaxGate = 0.6;        // m
constexpr double kMayFace = -0.15;      // n . d of a surface that a ray can have met
constexpr double kThinPlate = 0.12;     // m towards the lens, where its near side is looked for
constexpr double kWaveHeight = -0.05;   // m: a point above is a wave or a reflection
constexpr int kIterations = 6;
constexpr double kConverged = 3e-3;        // m and rad
constexpr double kNearlyConverged = 0.01;  // m and rad
constexpr int kCoarseStride = 4;           // of the rays, where a place is tried
constexpr double kCoarseReach = 0.35;      // m: a point farther from any surface is an outlier

struct Usable {
  std::vector<std::size_t> points;  // in the order of the scan, by index
  std::vector<bool> is_level;       // at the height where most points are
};

// The points on surfaces, without the vehicle itself and the water's surface.
Usable usable_points(const RangeScan& scan, const Matrix3d& R_WB, double height_W) {
  Usable usable;
  std::vector<double> bins;
  std::map<double, int> count;
  const Eigen::RowVector3f upwards = R_WB.row(2).cast<float>();
  for (std::size_t i = 0; i < scan.points_B.size(); ++i) {
    const float range = (scan.points_B[i] - scan.origin_B).norm();
    if (!(range >= static_cast<float>(kMinRange) && range <= scan.reach)) continue;
    const double z_W = height_W + static_cast<double>(upwards * scan.points_B[i]);
    if (z_W > kWaveHeight) continue;
    usable.points.push_back(i);
    bins.push_back(std::floor(z_W / kLevelBin));
    ++count[bins.back()];
  }
  const auto most = std::ranges::max_element(count, {}, &std::pair<const double, int>::second);
  for (const double bin : bins) usable.is_level.push_back(std::abs(bin - most->first) < 1.5);
  return usable;
}

}  // namespace

double FitNormal::excess() const { return weights > 0.0 ? std::max(1.0, squares / weights) : 1.0; }

FitMinimum FitMinimum::reweighted() const {
  FitMinimum result = *this;
  result.at.information /= at.excess();
  result.at.gradient /= at.excess();
  return result;
}

Eigen::Quaterniond turn_of(const Vector6d& shift) {
  return so3_exp(Vector3d(shift[kShiftTilt], shift[kShiftTilt + 1], shift[kShiftYaw]));
}

double widest_variance(const Matrix6d& covariance) {
  return std::max(covariance(0, 0), covariance(1, 1)) + std::abs(covariance(0, 1));
}

ScanFit::ScanFit(const MapSurface& surface, const RangeNoise& noise, const RangeScan& scan,
                 const Pose& X_WB)
    : surface_(surface), noise_(noise), p_W_(X_WB.p) {
  const Matrix3d R_WB = X_WB.q.toRotationMatrix();
  const Usable usable = usable_points(scan, R_WB, X_WB.p.z());
  const auto all = static_cast<double>(usable.points.size());
  const double stride = std::max(1.0, std::floor(all / kFixRays));
  std::vector<std::size_t> level;
  std::vector<std::size_t> others;
  for (std::size_t k = 0; k < usable.points.size(); ++k) {
    (usable.is_level[k] ? level : others).push_back(usable.points[k]);
  }
  const auto of_others = static_cast<double>(others.size());
  if (of_others == 0.0 || of_others >= kFewOthers * all) {
    sample(scan, R_WB, usable.points, stride, {1.0, 1.0});
    return;
  }
  const double boost = std::min(kFewOthers * all / of_others, kMostBoost);
  const double denser = std::max(1.0, stride / boost);
  sample(scan, R_WB, others, denser, {denser / stride, boost * denser / stride});
  sample(scan, R_WB, level, stride, {1.0, 1.0});
}

void ScanFit::sample(const RangeScan& scan, const Matrix3d& R_WB,
                     const std::vector<std::size_t>& points, double stride, const Worth& worth) {
  for (double i = std::floor(0.5 * stride); i < static_cast<double>(points.size()); i += stride) {
    const Vector3d b = scan.points_B[points[static_cast<std::size_t>(i)]].cast<double>();
    const Vector3d along_B = b - scan.origin_B.cast<double>();
    const double range = along_B.norm();
    rays_.push_back({R_WB * b, R_WB * along_B / range, range, worth});
  }
}

// The surface that a ray can have met near x.
std::optional<MapSurface::Nearest> ScanFit::met(const Ray& ray, const Vector3d& x,
                                                const Vector3d& direction, double reach) const {
  const Vector3d from = x - ray.range * direction;
  std::optional<MapSurface::Nearest> nearest = surface_.nearest(x, from, reach);
  if (!nearest || nearest->normal_W.dot(direction) <= kMayFace) return nearest;
  // Behind a thin plate the nearest surface is its far side.
  nearest = surface_.nearest(x - kThinPlate * direction, from, reach);
  if (!nearest) return std::nullopt;
  const double along = nearest->normal_W.dot(direction);
  if (along > kMayFace) return std::nullopt;
  nearest->height += kThinPlate * along;
  return nearest;
}

FitNormal ScanFit::linearise(const Vector6d& shift, const Matrix6d& covariance) const {
  return linearise_every(1, shift, covariance);
}

FitNormal ScanFit::linearise_every(int stride, const Vector6d& shift,
                                   const Matrix6d& covariance) const {
  FitNormal normal;
  const Matrix3d turn = turn_of(shift).toRotationMatrix();
  const double independent = stride * kIndependent;
  for (std::size_t i = 0; i < rays_.size(); i += static_cast<std::size_t>(stride)) {
    const Ray& ray = rays_[i];
    const Vector3d arm = turn * ray.arm_W;
    const Vector3d direction = turn * ray.direction_W;
    const Vector3d x = p_W_ + shift.head<3>() + arm;
    const auto nearest = met(ray, x, direction, kMaxGate);
    if (!nearest) {
      normal.gated += stride;
      normal.cost += independent * ray.worth.evidence * kOutlier;
      continue;
    }
    const Vector3d& n = nearest->normal_W;
    const Vector3d by_turn = arm.cross(n);
    Vector6d h;
    h << n, by_turn.z(), by_turn.x(), by_turn.y();
    const double range_sigma = noise_.sigma(ray.range) * n.dot(direction);
    const double variance = range_sigma * range_sigma + kSurfaceSigma * kSurfaceSigma +
                            std::pow(kAngleSigma * ray.range, 2);
    const double r = nearest->height;
    const double gate =
        std::clamp(3.0 * std::sqrt(h.dot(covariance * h) + variance), kMinGate, kMaxGate);
    const double sigmas = std::abs(r) / std::sqrt(variance);
    normal.cost += independent * ray.worth.evidence * std::min(sigmas * sigmas, kOutlier);
    if (std::abs(r) > gate) {
      normal.gated += stride;
      continue;
    }
    const double weight =
        independent * ray.worth.information * std::min(1.0, kHuber / sigmas) / variance;
    normal.information += weight * h * h.transpose();
    normal.gradient -= weight * r * h;
    const double horizontal = n.head<2>().squaredNorm();
    normal.squares += horizontal * std::min(sigmas * sigmas, kLargest);
    normal.weights += horizontal;
    normal.used += stride;
  }
  return normal;
}

FitMinimum ScanFit::descend(const Vector6d& from, const Vector6d& mean,
                            const Matrix6d& covariance) const {
  return descend_by(1, kConverged, from, mean, covariance);
}

FitMinimum ScanFit::approach(const Vector6d& from, const Vector6d& mean,
                             const Matrix6d& covariance) const {
  return descend_by(kCoarseStride, kNearlyConverged, from, mean, covariance);
}

FitMinimum ScanFit::descend_by(int stride, double converged, const Vector6d& from,
                               const Vector6d& mean, const Matrix6d& covariance) const {
  const Matrix6d prior = covariance.inverse();
  Vector6d shift = from;
  FitNormal normal = linearise_every(stride, shift, covariance);
  for (int i = 0; i < kIterations && normal.used >= FitMinimum::kMinUsed; ++i) {
    const Vector6d step =
        (normal.information + prior).ldlt().solve(normal.gradient - prior * (shift - mean));
    shift += step;
    normal = linearise_every(stride, shift, covariance);
    if (step.cwiseAbs().maxCoeff() < converged) break;
  }
  return {shift, normal};
}

double ScanFit::misfit(const Eigen::Vector2d& shift) const {
  const Vector3d at_W = p_W_ + Vector3d(shift.x(), shift.y(), 0.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < rays_.size(); i += std::size_t{kCoarseStride}) {
    const Vector3d x = at_W + rays_[i].arm_W;
    const auto nearest = met(rays_[i], x, rays_[i].direction_W, kCoarseReach);
    const double height =
        nearest ? std::min(std::abs(nearest->height), kCoarseReach) : kCoarseReach;
    sum += rays_[i].worth.evidence * height * height;
  }
  return sum;
}

}  // namespace dive::planning
