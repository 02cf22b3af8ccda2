#include "estimation/visual_inertial/filter/first_motion.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kMinPoints = 12;  // seen from both frames
constexpr int kRounds = 5;              // of the weights against points that move

struct Rays {
  Vector3d before;  // turned into the later camera
  Vector3d now;
};

std::vector<Rays> rays_to(const StartWindow& window, std::size_t frame,
                          const Eigen::Quaterniond& q_C1C0) {
  std::vector<Rays> rays;
  for (const FeatureTrack& track : window.tracks) {
    if (track.observations.front().frame != 0) continue;
    for (const auto& view : track.observations) {
      if (view.frame != static_cast<std::int64_t>(frame)) continue;
      rays.push_back({q_C1C0 * track.observations.front().left.homogeneous().normalized(),
                      view.left.homogeneous().normalized()});
    }
  }
  return rays;
}

// t of p_C1 = R p_C0 + t: orthogonal to all now x before, by reweighted least squares.
Vector3d translation(const std::vector<Rays>& rays, double sigma) {
  Vector3d t = Vector3d::UnitZ();
  for (int round = 0; round < kRounds; ++round) {
    Matrix3d M = Matrix3d::Zero();
    for (const Rays& ray : rays) {
      const Vector3d n = ray.now.cross(ray.before);
      const double error = round == 0 ? 0.0 : t.dot(n);
      M += n * n.transpose() / (sigma * sigma + error * error);
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(M);
    t = eigen.eigenvectors().col(0);
  }
  int ahead = 0;
  for (const Rays& ray : rays) {
    const Vector3d n = ray.before.cross(ray.now);
    ahead += -t.cross(ray.now).dot(n) > 0.0 ? 1 : -1;
  }
  return ahead >= 0 ? t : Vector3d(-t);
}

}  // namespace

std::optional<FirstMotion> find_first_motion(const StartWindow& window, const Pose& X_BC,
                                             const Vector3d& gyro_bias) {
  ImuState state;
  state.gyro_bias = gyro_bias;
  FirstMotion motion;
  std::optional<FirstMotion> found;
  for (std::size_t k = 1; k < window.size(); ++k) {
    state = propagate_over(state, window.imu[k - 1], ImuNoise{}, 0.0).state;
    for (const ImuInterval& interval : window.imu[k - 1]) motion.seconds += interval.dt;
    const double T = motion.seconds;
    motion.up_B = state.motion.v_WB / T;
    const Eigen::Quaterniond q_C1C0 =
        (X_BC.q.conjugate() * state.motion.q_WB.conjugate() * X_BC.q).normalized();
    const std::vector<Rays> rays = rays_to(window, k, q_C1C0);
    if (rays.size() < kMinPoints) break;
    const Vector3d t = translation(rays, std::sqrt(2.0) * window.sigma);
    motion.direction_B = -(X_BC.q * (q_C1C0.conjugate() * t)).normalized();
    // p_K = v T + g T^2 / 2 + a_K with g = -up; the camera's lever arm turns with the body.
    motion.by_imu_B =
        state.motion.p_WB - 0.5 * T * T * motion.up_B + (state.motion.q_WB * X_BC.p - X_BC.p);
    found = motion;
  }
  if (found) found->up_B = motion.up_B;
  return found;
}

}  // namespace dive::estimation
