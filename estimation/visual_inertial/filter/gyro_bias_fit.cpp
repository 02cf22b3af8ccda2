#include "estimation/visual_inertial/filter/gyro_bias_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "common/se3.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kMaxBiasSteps = 12;
constexpr double kBiasSettled = 1e-6;    // rad/s
constexpr std::size_t kMinRayPairs = 8;  // of rays, for one translation
constexpr double kOutlierSigmas = 3.0;   // beyond it the weight falls
constexpr double kUsualOfMedian = 1.48;  // sigma over median of the absolute values

struct RayPair {
  Vector3d before;
  Vector3d now;
};

// The rays of the left camera in frames k and k + 1.
std::vector<RayPair> pairs_of(const StartWindow& window, std::size_t k) {
  const auto frame = static_cast<std::int64_t>(k);
  std::vector<RayPair> pairs;
  for (const FeatureTrack& track : window.tracks) {
    for (std::size_t i = 1; i < track.observations.size(); ++i) {
      const auto& before = track.observations[i - 1];
      const auto& now = track.observations[i];
      if (before.frame != frame || now.frame != frame + 1) continue;
      pairs.push_back(
          {before.left.homogeneous().normalized(), now.left.homogeneous().normalized()});
    }
  }
  return pairs;
}

// Rotation by the gyro, and its change with the bias: R(b + d) = R Exp(J d).
struct Turn {
  Quaterniond q_B0B1 = Quaterniond::Identity();
  Matrix3d by_bias = Matrix3d::Zero();
};

Turn turn_over(const std::vector<ImuInterval>& imu, const Vector3d& bias) {
  Turn turn;
  for (const ImuInterval& interval : imu) {
    const Vector3d w = (0.5 * (interval.begin.gyro_B + interval.end.gyro_B) - bias) * interval.dt;
    const Quaterniond step = so3_exp(w);
    turn.by_bias = step.conjugate() * turn.by_bias;
    turn.by_bias -= right_jacobian(w) * interval.dt;
    turn.q_B0B1 = (turn.q_B0B1 * step).normalized();
  }
  return turn;
}

struct BiasSystem {
  Matrix3d information = Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();
};

void add(const std::vector<RayPair>& pairs, const Turn& turn, const Quaterniond& q_BC, double sigma,
         BiasSystem& normal) {
  const Quaterniond q_C1C0 = (q_BC.conjugate() * turn.q_B0B1.conjugate() * q_BC).normalized();
  const Matrix3d by_bias = q_BC.conjugate() * turn.by_bias;
  Matrix3d M = Matrix3d::Zero();
  for (const RayPair& pair : pairs) {
    const Vector3d n = pair.now.cross(q_C1C0 * pair.before);
    M += n * n.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(M);
  const Vector3d t = eigen.eigenvectors().col(0);
  std::vector<double> residuals(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    residuals[i] = t.dot(pairs[i].now.cross(q_C1C0 * pairs[i].before));
  }
  std::vector<double> sizes = residuals;
  for (double& size : sizes) size = std::abs(size);
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  const double usual = std::max(sigma, kUsualOfMedian * *middle);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vector3d w = q_C1C0 * pairs[i].before;
    const Vector3d& f = pairs[i].now;
    const Vector3d J = -(by_bias.transpose() * (f.dot(w) * t - t.dot(w) * f));
    const double sigmas = std::abs(residuals[i]) / usual;
    const double weight =
        (sigmas > kOutlierSigmas ? kOutlierSigmas / sigmas : 1.0) / (usual * usual);
    normal.information += weight * J * J.transpose();
    normal.gradient -= weight * J * residuals[i];
  }
}

}  // namespace

Vector3d fit_gyro_bias(const StartWindow& window, const Quaterniond& q_BC, const Vector3d& prior,
                       double prior_sigma) {
  std::vector<std::vector<RayPair>> pairs;
  for (std::size_t k = 0; k + 1 < window.size(); ++k) pairs.push_back(pairs_of(window, k));
  const double sigma = std::sqrt(2.0) * window.sigma;  // two images
  const double prior_weight = 1.0 / (prior_sigma * prior_sigma);
  Vector3d bias = prior;
  for (int i = 0; i < kMaxBiasSteps; ++i) {
    BiasSystem normal;
    normal.information = prior_weight * Matrix3d::Identity();
    normal.gradient = prior_weight * (prior - bias);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (pairs[k].size() < kMinRayPairs) continue;
      add(pairs[k], turn_over(window.imu[k], bias), q_BC, sigma, normal);
    }
    const Vector3d step = normal.information.ldlt().solve(normal.gradient);
    if (!step.allFinite()) return prior;
    bias += step;
    if (step.norm() < kBiasSettled) break;
  }
  return bias;
}

}  // namespace dive::estimation
