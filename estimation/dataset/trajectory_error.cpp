#include "estimation/dataset/trajectory_error.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/SVD>

#include "common/assert.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMaxGap = 0.2;         // s, maximum interval of interpolated truth
constexpr double kOnePlace = 1e-6;      // m
constexpr double kMinPathLength = 0.1;  // m, shortest path with a meaningful drift

struct Moments {
  Vector3d mean_estimate = Vector3d::Zero();
  Vector3d mean_truth = Vector3d::Zero();
  Matrix3d cross = Matrix3d::Zero();  // sum of (truth - mean) (estimate - mean)^T, over n
};

Moments moments_of(const std::vector<PosePair>& pairs) {
  Moments m;
  const double n = static_cast<double>(pairs.size());
  for (const PosePair& pair : pairs) {
    m.mean_estimate += pair.estimate.p / n;
    m.mean_truth += pair.truth.p / n;
  }
  for (const PosePair& pair : pairs) {
    m.cross += (pair.truth.p - m.mean_truth) * (pair.estimate.p - m.mean_estimate).transpose() / n;
  }
  return m;
}

std::optional<Matrix3d> rigid_rotation(const Matrix3d& cross) {
  const Eigen::JacobiSVD<Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()(1) > kOnePlace * kOnePlace)) return std::nullopt;
  Matrix3d S = Matrix3d::Identity();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) S(2, 2) = -1.0;
  return svd.matrixU() * S * svd.matrixV().transpose();
}

std::optional<Matrix3d> yaw_rotation(const Matrix3d& cross) {
  const double sine = cross(1, 0) - cross(0, 1);
  const double cosine = cross(0, 0) + cross(1, 1);
  if (!(std::hypot(sine, cosine) > kOnePlace * kOnePlace)) return std::nullopt;
  return Eigen::AngleAxisd(std::atan2(sine, cosine), Vector3d::UnitZ()).toRotationMatrix();
}

double degrees_between(const Pose& a, const Pose& b) { return rad_to_deg(angle_between(a.q, b.q)); }

// Squared Mahalanobis length; negative if the covariance is not positive definite.
double squared(const Vector3d& error, const Matrix3d& P) {
  const Eigen::LLT<Matrix3d> llt(P);
  if (llt.info() != Eigen::Success) return -1.0;
  return error.dot(llt.solve(error));
}

}  // namespace

std::vector<PosePair> pair_up(const Trajectory& estimate, const Trajectory& truth) {
  std::vector<PosePair> pairs;
  for (const StampedPose& at : estimate) {
    if (const auto X = pose_at(truth, at.utime, kMaxGap)) {
      pairs.push_back({at.utime, at.X_WB, *X});
    }
  }
  return pairs;
}

std::optional<Pose> align(const std::vector<PosePair>& pairs, Alignment alignment) {
  if (alignment == Alignment::kNone) return Pose{};
  if (pairs.size() < 3) return std::nullopt;
  const Moments m = moments_of(pairs);
  const auto R = alignment == Alignment::kRigid ? rigid_rotation(m.cross) : yaw_rotation(m.cross);
  if (!R) return std::nullopt;
  return Pose{m.mean_truth - *R * m.mean_estimate, Eigen::Quaterniond(*R).normalized()};
}

AbsoluteError absolute_error(const std::vector<PosePair>& pairs, const Pose& X_TE) {
  AbsoluteError error;
  if (pairs.empty()) return error;
  for (const PosePair& pair : pairs) {
    const Pose aligned = X_TE * pair.estimate;
    const double distance2 = (aligned.p - pair.truth.p).squaredNorm();
    const double angle = degrees_between(aligned, pair.truth);
    error.rmse_m += distance2;
    error.rmse_deg += angle * angle;
    error.max_m = std::max(error.max_m, std::sqrt(distance2));
  }
  const double n = static_cast<double>(pairs.size());
  error.rmse_m = std::sqrt(error.rmse_m / n);
  error.rmse_deg = std::sqrt(error.rmse_deg / n);
  return error;
}

RelativeError relative_error(const std::vector<PosePair>& pairs, double distance_m) {
  DIVE_DEMAND(distance_m > 0.0);
  RelativeError error;
  error.distance_m = distance_m;
  std::vector<double> along(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    along[i] = along[i - 1] + (pairs[i].truth.p - pairs[i - 1].truth.p).norm();
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto end = std::lower_bound(along.begin(), along.end(), along[i] + distance_m);
    if (end == along.end()) break;
    const auto j = static_cast<std::size_t>(end - along.begin());
    const Pose estimated = pairs[i].estimate.inverse() * pairs[j].estimate;
    const Pose travelled = pairs[i].truth.inverse() * pairs[j].truth;
    error.mean_m += (estimated.p - travelled.p).norm();
    error.mean_deg += degrees_between(estimated, travelled);
    ++error.stretches;
  }
  if (error.stretches > 0) {
    error.mean_m /= error.stretches;
    error.mean_deg /= error.stretches;
    error.percent = 100.0 * error.mean_m / distance_m;
  }
  return error;
}

double drift_percent(const std::vector<PosePair>& pairs) {
  double length = 0.0;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    length += (pairs[i].truth.p - pairs[i - 1].truth.p).norm();
  }
  if (length < kMinPathLength) return 0.0;
  const double yaw = to_rpy(pairs.front().truth.q).z() - to_rpy(pairs.front().estimate.q).z();
  const Eigen::Quaterniond turn = from_rpy(0.0, 0.0, yaw);
  const Vector3d estimated = turn * (pairs.back().estimate.p - pairs.front().estimate.p);
  const Vector3d travelled = pairs.back().truth.p - pairs.front().truth.p;
  return 100.0 * (estimated - travelled).norm() / length;
}

Nees nees(const std::vector<StateEstimate>& estimates, const Trajectory& truth) {
  Nees result;
  for (const StateEstimate& estimate : estimates) {
    const auto X = pose_at(truth, estimate.utime, kMaxGap);
    if (!estimate.valid || !X) continue;
    const double position =
        squared(X->p - estimate.X_WB.p, estimate.covariance.topLeftCorner<3, 3>());
    const double orientation = squared(so3_log(estimate.X_WB.q.conjugate() * X->q),
                                       estimate.covariance.bottomRightCorner<3, 3>());
    if (position < 0.0 || orientation < 0.0) continue;
    result.position += position;
    result.orientation += orientation;
    ++result.samples;
  }
  if (result.samples > 0) {
    result.position /= result.samples;
    result.orientation /= result.samples;
  }
  return result;
}

std::vector<double> closure_errors(const std::vector<LoopClosure>& closures,
                                   const Trajectory& truth) {
  std::vector<double> errors;
  for (const LoopClosure& closure : closures) {
    const auto then = pose_at(truth, closure.utime_old, kMaxGap);
    const auto now = pose_at(truth, closure.utime_new, kMaxGap);
    if (!then || !now) continue;
    errors.push_back(((then->inverse() * *now).p - closure.X_B0B1.p).norm());
  }
  return errors;
}

}  // namespace dive::estimation
