#include "estimation/visual_inertial/front_end/epipolar.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace dive::estimation {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMaxSamples = 100;
constexpr std::size_t kMinMovedFeatures =
    8;                                  // minimum of moved points that determine a translation
constexpr double kConfidence = 0.9999;  // probability of having drawn two static points
constexpr double kMinNormal2 = 1e-6;    // of an epipolar line; less is at the epipole
constexpr double kClear = 2.0;          // tolerances of parallax that separate front from behind

struct Moved {
  Vector3d before;
  Vector3d cross;           // b x f
  Vector3d now;             // f
  Matrix2d line_in_pixels;  // J^-T
  double parallax2;         // pixels^2
  std::size_t index;
};

// Squared length of the normal of the epipolar line for t through `before`, in 1/pixels.
double normal2(const Moved& m, const Vector3d& t) {
  const Vector2d line(t.y() - t.z() * m.before.y(), t.z() * m.before.x() - t.x());
  return (m.line_in_pixels * line).squaredNorm();
}

// Squared distance of `now` from the epipolar line through `before`, pixels^2.
double error2(const Moved& m, const Vector3d& t) {
  const double along = t.dot(m.cross);
  const double line2 = normal2(m, t);
  // Every line passes through the epipole: no point is farther from its line than it has moved.
  return along * along < m.parallax2 * line2 ? along * along / line2 : m.parallax2;
}

double cost(const std::vector<Moved>& moved, const Vector3d& t, double tolerance2) {
  double sum = 0.0;
  for (const Moved& m : moved) sum += std::min(error2(m, t), tolerance2);
  return sum;
}

// The least-squares translation of the points that agree with t.
Vector3d refined(const std::vector<Moved>& moved, const Vector3d& t, double tolerance2) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  for (const Moved& m : moved) {
    const double line2 = normal2(m, t);
    if (error2(m, t) < tolerance2 && line2 > kMinNormal2 * m.line_in_pixels.squaredNorm()) {
      A += m.cross * m.cross.transpose() / line2;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(A);
  return eigen.eigenvectors().col(0);
}

int samples_for(double share) {
  const double both = share * share;
  if (both > 1.0 - 1e-9) return 1;
  const double wanted = std::log(1.0 - kConfidence) / std::log(1.0 - both);
  return static_cast<int>(std::min(wanted + 1.0, 1.0 * kMaxSamples));
}

Vector3d best_translation(const std::vector<Moved>& moved, double tolerance2, Random& random) {
  const std::uint64_t n = moved.size();
  Vector3d best = Vector3d::UnitZ();
  double least = cost(moved, best, tolerance2);  // straight ahead: a vehicle's usual motion
  int samples = kMaxSamples;
  for (int k = 0; k < samples; ++k) {
    const Vector3d& a = moved[random.bits() % n].cross;
    const Vector3d& b = moved[random.bits() % n].cross;
    const Vector3d t = a.cross(b);
    const double norm = t.norm();
    if (norm < 1e-6 * a.norm() * b.norm()) continue;
    const double sum = cost(moved, t / norm, tolerance2);
    if (sum >= least) continue;
    least = sum;
    best = t / norm;
    const double share = 1.0 - sum / (tolerance2 * static_cast<double>(n));
    samples = std::min(samples, samples_for(share));
  }
  for (int k = 0; k < 3; ++k) {
    const Vector3d t = refined(moved, best, tolerance2);
    const double sum = cost(moved, t, tolerance2);
    if (!(sum < least)) break;
    least = sum;
    best = t;
  }
  return best;
}

// True if the point's depth is positive for t.
bool is_ahead(const Moved& m, const Vector3d& t) { return -t.cross(m.now).dot(m.cross) > 0.0; }

}  // namespace

std::vector<bool> agree_with_one_translation(const std::vector<TurnedMatch>& matches,
                                             double tolerance_px, Random& random) {
  std::vector<bool> agrees(matches.size(), true);
  const double tolerance2 = tolerance_px * tolerance_px;
  std::vector<Moved> moved;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Vector3d now = matches[i].now.homogeneous();
    const Vector3d& before = matches[i].before;
    const Matrix2d& J = matches[i].to_pixels;
    const double parallax2 = (J * (now - before).head<2>()).squaredNorm();
    if (parallax2 > tolerance2) {
      moved.push_back({before, before.cross(now), now, J.inverse().transpose(), parallax2, i});
    }
  }
  if (moved.size() < kMinMovedFeatures) return agrees;

  const Vector3d t = best_translation(moved, tolerance2, random);
  int ahead = 0;
  int behind = 0;
  const double clear2 = kClear * kClear * tolerance2;
  for (const Moved& m : moved) {
    agrees[m.index] = error2(m, t) <= tolerance2;
    if (!agrees[m.index] || m.parallax2 < clear2) continue;
    ++(is_ahead(m, t) ? ahead : behind);
  }
  const Vector3d towards = ahead >= behind ? t : Vector3d(-t);
  for (const Moved& m : moved) {
    if (m.parallax2 >= clear2 && !is_ahead(m, towards)) agrees[m.index] = false;
  }
  return agrees;
}

}  // namespace dive::estimation
