#include "estimation/visual_inertial/filter/linear_start.h"

#include <algorithm>

#include <Eigen/Cholesky>

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix36d = Eigen::Matrix<double, 3, 6>;

constexpr double kGravitySigma = 1.0;  // m/s^2, of the accelerometer's mean as gravity
constexpr int kRounds = 3;             // of the weights, which depend on the points' distances
constexpr double kUsualRange = 3.0;    // m, before they are known
constexpr double kNear = 0.3;          // m
constexpr double kFar = 20.0;          // m

// What the IMU says of one frame, in B0.
struct Moved {
  double t = 0.0;
  Kinematics motion;  // with no initial velocity and no gravity
};

std::vector<Moved> moved_by_imu(const StartWindow& window, const Vector3d& gyro_bias) {
  std::vector<Moved> frames(1);
  ImuState state;
  state.gyro_bias = gyro_bias;
  double t = 0.0;
  for (const auto& imu : window.imu) {
    state = propagate_over(state, imu, ImuNoise{}, 0.0).state;
    for (const ImuInterval& interval : imu) t += interval.dt;
    frames.push_back({t, state.motion});
  }
  return frames;
}

// One point: its position is linear in x = [v, g].
struct Point {
  Matrix3d A = Matrix3d::Zero();
  Matrix36d B = Matrix36d::Zero();
  Vector3d c = Vector3d::Zero();
  Matrix6d xx = Matrix6d::Zero();
  Vector6d x1 = Vector6d::Zero();

  void add(const Vector3d& ray, const Vector3d& centre, double t) {
    const Matrix3d across = Matrix3d::Identity() - ray * ray.transpose();
    Matrix36d M;
    M << t * Matrix3d::Identity(), 0.5 * t * t * Matrix3d::Identity();
    A += across;
    B += across * M;
    c += across * centre;
    xx += M.transpose() * across * M;
    x1 += M.transpose() * across * centre;
  }

  // A point without parallax has no distance; this leaves it at the origin.
  [[nodiscard]] Eigen::LDLT<Matrix3d> solver() const {
    return Eigen::LDLT<Matrix3d>(A + 1e-6 * Matrix3d::Identity());
  }
};

std::vector<Point> points_of(const StartWindow& window, const std::vector<Pose>& cameras_B,
                             const std::vector<Moved>& frames) {
  std::vector<Point> points;
  for (const WindowTrack& track : window.tracks) {
    Point point;
    for (const auto& view : track.views) {
      const Moved& frame = frames[view.frame];
      const auto add = [&](const Pose& X_BC, const Vector2d& image) {
        const Vector3d ray = frame.motion.q_WB * (X_BC.q * image.homogeneous().normalized());
        point.add(ray, frame.motion.p_WB + frame.motion.q_WB * X_BC.p, frame.t);
      };
      add(cameras_B[0], view.left);
      if (view.right && cameras_B.size() > 1) add(cameras_B[1], *view.right);
    }
    points.push_back(point);
  }
  return points;
}

}  // namespace

LinearStart solve_linear_start(const StartWindow& window, const std::vector<Pose>& cameras_B,
                               const Vector3d& gyro_bias, const LinearPrior& prior) {
  const std::vector<Moved> frames = moved_by_imu(window, gyro_bias);
  const Vector3d g_prior = -frames.back().motion.v_WB / frames.back().t;
  const std::vector<Point> points = points_of(window, cameras_B, frames);
  Vector6d x;
  x << prior.v_B, g_prior;
  const Vector6d x_prior = x;
  Vector6d information;
  information << Vector3d::Constant(1.0 / (prior.speed_sigma * prior.speed_sigma)),
      Vector3d::Constant(1.0 / (kGravitySigma * kGravitySigma));
  for (int round = 0; round < kRounds; ++round) {
    Matrix6d H = information.asDiagonal();
    Vector6d b = information.cwiseProduct(x_prior);
    for (const Point& point : points) {
      const auto solver = point.solver();
      const double range =
          round == 0 ? kUsualRange
                     : std::clamp(solver.solve(point.B * x + point.c).norm(), kNear, kFar);
      const double weight = 1.0 / (window.sigma * window.sigma * range * range);
      H += weight * (point.xx - point.B.transpose() * solver.solve(point.B));
      b += weight * (point.B.transpose() * solver.solve(point.c) - point.x1);
    }
    const Vector6d solved = H.ldlt().solve(b);
    if (!solved.allFinite()) break;
    x = solved;
  }
  return {x.head<3>(), x.tail<3>()};
}

}  // namespace dive::estimation
