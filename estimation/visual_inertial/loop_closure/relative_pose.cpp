#include "estimation/visual_inertial/loop_closure/relative_pose.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace dive::estimation {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;
using Matrix36d = Eigen::Matrix<double, 3, 6>;
using Matrix63d = Eigen::Matrix<double, 6, 3>;

constexpr int kRansacRounds = 200;
constexpr double kRansacSigma = 3.0;
constexpr double kRansacSure = 0.999;
constexpr int kSteps = 15;
constexpr int kRounds = 3;  // each with the points that agreed in the one before
constexpr int kPointSteps = 3;
constexpr std::size_t kMinInitialPoints = 8;
constexpr double kPoseConverged = 1e-6;  // m and rad
constexpr double kMinParallax = 3.0;     // sigma of a disparity, for a point to have a position
constexpr double kMinDepth = 0.05;       // m
constexpr int kImageColumns = 4;
constexpr int kImageRows = 3;
// chi^2 exceeded with a probability of 1 %, by degrees of freedom.
constexpr std::array<double, 6> kMaxChiSquare{0.0, 6.63, 9.21, 11.34, 13.28, 15.09};

// A point in one keyframe, with d pixel / d n of the left and of the right camera there.
struct ObservedPoint {
  Vector2d left;
  std::optional<Vector2d> right;
  std::array<Matrix2d, 2> to_pixels;
};

// A point in both keyframes; f: its position in the left camera then, m.
struct MatchedPoint {
  Vector3d f;
  ObservedPoint then;
  ObservedPoint now;
};

ObservedPoint observed(const KeyframePoint& point, const RelativePoseOptions& options) {
  ObservedPoint result{point.left, point.right, {}};
  result.to_pixels[0] = options.cameras[0].jacobian(point.left);
  if (point.right) result.to_pixels[1] = options.cameras[1].jacobian(*point.right);
  return result;
}

// From two image points: (b + rho p) in the right camera, two equations linear in rho.
std::optional<Vector3d> place(const ObservedPoint& point, const Pose& X_RL, double sigma_px) {
  if (!point.right) return std::nullopt;
  const Vector3d b = X_RL.q * point.left.homogeneous();
  const Vector2d a = point.to_pixels[1] * (X_RL.p.head<2>() - *point.right * X_RL.p.z());
  const Vector2d c = point.to_pixels[1] * (*point.right * b.z() - b.head<2>());
  const double rho = a.dot(c) / a.squaredNorm();
  if (!(rho * a.norm() > kMinParallax * sigma_px) || rho > 1.0 / kMinDepth) return std::nullopt;
  return Vector3d(point.left.homogeneous() / rho);
}

// PnP: initial pose of the present camera, and the points that agree.
std::optional<Pose> begin(std::vector<MatchedPoint>& matched, const RelativePoseOptions& options) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const MatchedPoint& s : matched) {
    points.emplace_back(s.f.x(), s.f.y(), s.f.z());
    pixels.emplace_back(s.now.left.x(), s.now.left.y());
  }
  cv::Mat turn, shift;
  std::vector<int> inliers;
  try {
    // The earlier position has an error too, which grows with the camera's motion. Off the axis of
    // a wide lens the tolerance is narrow: agreeing() takes the points that are missing then.
    const double sigma =
        (options.pixels_now + 2.0 * options.pixels_then) / options.cameras[0].focal();
    const float tolerance = static_cast<float>(kRansacSigma * sigma);
    if (!cv::solvePnPRansac(points, pixels, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), turn, shift,
                            false, kRansacRounds, tolerance, kRansacSure, inliers,
                            cv::SOLVEPNP_P3P)) {
      return std::nullopt;
    }
  } catch (const cv::Exception&) {  // if the points determine nothing
    return std::nullopt;
  }
  std::vector<MatchedPoint> agreeing;
  agreeing.reserve(inliers.size());
  for (const int i : inliers) agreeing.push_back(matched[static_cast<std::size_t>(i)]);
  matched = std::move(agreeing);
  const Vector3d r(turn.at<double>(0), turn.at<double>(1), turn.at<double>(2));
  const Vector3d t(shift.at<double>(0), shift.at<double>(1), shift.at<double>(2));
  const Pose X_C1C0{t, so3_exp(r)};
  if (!X_C1C0.is_finite()) return std::nullopt;
  return X_C1C0.inverse();
}

// Sums over the image points of one landmark; residuals in sigmas.
struct PointSystem {
  Matrix6d H_xx = Matrix6d::Zero();
  Matrix63d H_xf = Matrix63d::Zero();
  Matrix3d H_ff = Matrix3d::Zero();
  Vector6d b_x = Vector6d::Zero();
  Vector3d b_f = Vector3d::Zero();
  double chi2 = 0.0;
  int rows = 0;
  bool is_before_all = true;

  // `weight`: d pixel / d n over the sigma of a pixel.
  void add(const Vector3d& h, const Vector2d& measured, const Matrix2d& weight,
           const Matrix3d& by_f, const Matrix36d& by_x) {
    if (!(h.z() > kMinDepth)) {
      is_before_all = false;
      return;
    }
    Matrix23d E;
    E << 1.0, 0.0, -h.x() / h.z(), 0.0, 1.0, -h.y() / h.z();
    E = weight / h.z() * E;
    const Matrix23d F = E * by_f;
    const Matrix26d X = E * by_x;
    const Vector2d r = weight * (measured - h.head<2>() / h.z());
    H_xx += X.transpose() * X;
    H_xf += X.transpose() * F;
    H_ff += F.transpose() * F;
    b_x += X.transpose() * r;
    b_f += F.transpose() * r;
    chi2 += r.squaredNorm();
    rows += 2;
  }
};

PointSystem system_of(const MatchedPoint& s, const Pose& X, const Pose& X_RL,
                      const RelativePoseOptions& options) {
  const Matrix3d R_RL = X_RL.q.toRotationMatrix();
  const Matrix3d R_10 = X.q.conjugate().toRotationMatrix();
  PointSystem system;
  const auto weight = [](const ObservedPoint& point, std::size_t camera, double sigma_px) {
    return Matrix2d(point.to_pixels[camera] / sigma_px);
  };
  system.add(s.f, s.then.left, weight(s.then, 0, options.pixels_then), Matrix3d::Identity(),
             Matrix36d::Zero());
  if (s.then.right) {
    system.add(X_RL * s.f, *s.then.right, weight(s.then, 1, options.pixels_then), R_RL,
               Matrix36d::Zero());
  }
  const Vector3d f_1 = R_10 * (s.f - X.p);
  Matrix36d by_x;
  by_x << -R_10, skew(f_1);
  system.add(f_1, s.now.left, weight(s.now, 0, options.pixels_now), R_10, by_x);
  if (s.now.right) {
    system.add(X_RL * f_1, *s.now.right, weight(s.now, 1, options.pixels_now), R_RL * R_10,
               R_RL * by_x);
  }
  return system;
}

// Gauss-Newton; empty if it does not converge.
std::optional<Matrix6d> adjust(std::vector<MatchedPoint>& matched, Pose& X, const Pose& X_RL,
                               const RelativePoseOptions& options) {
  for (int i = 0; i < kSteps; ++i) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    std::vector<PointSystem> systems;
    for (const MatchedPoint& s : matched) {
      systems.push_back(system_of(s, X, X_RL, options));
      const PointSystem& p = systems.back();
      if (!p.is_before_all) continue;
      const Matrix63d K = p.H_xf * p.H_ff.inverse();
      H += p.H_xx - K * p.H_xf.transpose();
      b += p.b_x - K * p.b_f;
    }
    const Eigen::LLT<Matrix6d> llt(H);
    if (llt.info() != Eigen::Success) return std::nullopt;
    const Vector6d step = llt.solve(b);
    if (!step.allFinite()) return std::nullopt;
    X.p += step.head<3>();
    X.q = (X.q * so3_exp(step.tail<3>())).normalized();
    for (std::size_t k = 0; k < matched.size(); ++k) {
      const PointSystem& p = systems[k];
      if (!p.is_before_all) continue;
      matched[k].f += p.H_ff.inverse() * (p.b_f - p.H_xf.transpose() * step);
    }
    if (step.norm() < kPoseConverged) return Matrix6d(llt.solve(Matrix6d::Identity()));
  }
  return std::nullopt;
}

// The points that agree with X, each at its best position given X and its matched.
std::vector<MatchedPoint> agreeing(std::vector<MatchedPoint> matched, const Pose& X,
                                   const Pose& X_RL, const RelativePoseOptions& options) {
  std::erase_if(matched, [&](MatchedPoint& s) {
    PointSystem system = system_of(s, X, X_RL, options);
    for (int i = 0; i < kPointSteps && system.is_before_all; ++i) {
      s.f += system.H_ff.inverse() * system.b_f;
      system = system_of(s, X, X_RL, options);
    }
    const auto freedom = static_cast<std::size_t>(std::max(0, system.rows - 3));
    return !system.is_before_all || !(system.chi2 <= kMaxChiSquare.at(freedom));
  });
  return matched;
}

int cells(const std::vector<MatchedPoint>& matched, const RelativePoseOptions& options) {
  std::array<bool, std::size_t{kImageColumns} * kImageRows> has{};
  for (const MatchedPoint& s : matched) {
    const auto part = [](double at, int size, int count) {
      return std::clamp(static_cast<int>((at + 0.5) / size * count), 0, count - 1);
    };
    const CameraModel& left = options.cameras[0];
    const Vector2d pixel = left.distort(s.now.left);
    const int column = part(pixel.x(), left.width, kImageColumns);
    const int row = part(pixel.y(), left.height, kImageRows);
    has[static_cast<std::size_t>(row * kImageColumns + column)] = true;
  }
  return static_cast<int>(std::count(has.begin(), has.end(), true));
}

}  // namespace

std::optional<RelativePose> relative_pose(
    const KeyframeView& then, const KeyframeView& now,
    const std::vector<std::pair<std::size_t, std::size_t>>& matches, const Pose& X_RL,
    const RelativePoseOptions& options) {
  std::vector<MatchedPoint> matched;
  for (const auto& [i, j] : matches) {
    const ObservedPoint point = observed(then.points.at(i), options);
    if (const auto f = place(point, X_RL, options.pixels_then)) {
      matched.push_back({*f, point, observed(now.points.at(j), options)});
    }
  }
  const std::size_t min_points =
      std::max(static_cast<std::size_t>(options.min_points),
               static_cast<std::size_t>(options.min_share * static_cast<double>(matched.size())));
  if (matched.size() < min_points) return std::nullopt;
  std::vector<MatchedPoint> chosen = matched;
  std::optional<Pose> X = begin(chosen, options);
  if (!X) return std::nullopt;
  std::optional<Matrix6d> covariance;
  for (int i = 0; i < kRounds; ++i) {
    if (chosen.size() < kMinInitialPoints) return std::nullopt;
    covariance = adjust(chosen, *X, X_RL, options);
    if (!covariance) return std::nullopt;
    chosen = agreeing(matched, *X, X_RL, options);
  }
  if (chosen.size() < min_points || cells(chosen, options) < options.min_cells) return std::nullopt;
  return RelativePose{*X, *covariance, static_cast<int>(chosen.size())};
}

}  // namespace dive::estimation
