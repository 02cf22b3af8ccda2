#include "planning/trajopt/smooth_costs.h"

#include <cmath>

namespace dive::planning {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix212 = Eigen::Matrix<double, 2, 12>;

constexpr double kNoDirection = 1e-6;  // m: a shorter motion has no direction

Matrix3d relevant(AttitudeMode attitude) {
  return attitude == AttitudeMode::kHorizontal ? Matrix3d(Vector3d(1, 1, 0).asDiagonal())
                                               : Matrix3d(Matrix3d::Identity());
}

// The vector of angles between a unit vector b and the x axis, and its derivative by b.
Vector2d off_axis(const Vector3d& b, Matrix23& derivative) {
  const Vector2d across = b.tail<2>();
  const double sine = across.norm();
  derivative.setZero();
  if (sine < 1e-9) {
    derivative.rightCols<2>().setIdentity();
    // Straight backwards every rotation is equally short: turn by yaw.
    return b.x() > 0.0 ? across : Vector2d(M_PI, 0.0);
  }
  const double angle = std::atan2(sine, b.x());
  const Vector2d e = across / sine;
  derivative.col(0) = -sine * e;
  derivative.rightCols<2>() =
      b.x() * e * e.transpose() + angle / sine * (Eigen::Matrix2d::Identity() - e * e.transpose());
  return angle * e;
}

// z of the body's y axis: zero when level.
double sine_of_bank(const Eigen::Quaterniond& q_WB) { return (q_WB * Vector3d::UnitY()).z(); }

// Adds w |r + J x|^2 over waypoints i and i + 1 to the programme.
template <int Rows>
void add_square(double weight, const Eigen::Matrix<double, Rows, 1>& r,
                const Eigen::Matrix<double, Rows, 12>& J, int i, BandedQp& qp) {
  const auto head = J.template leftCols<6>();
  const auto tail = J.template rightCols<6>();
  qp.hessian().diagonal(i).noalias() += 2.0 * weight * head.transpose() * head;
  qp.hessian().lower(i).noalias() += 2.0 * weight * tail.transpose() * head;
  qp.hessian().diagonal(i + 1).noalias() += 2.0 * weight * tail.transpose() * tail;
  qp.gradient(i).noalias() += 2.0 * weight * head.transpose() * r;
  qp.gradient(i + 1).noalias() += 2.0 * weight * tail.transpose() * r;
}

// Adds w/2 |r + x_b - R x_a|^2, where R is a rotation, so R'R is the identity, and x_a, x_b are
// three numbers, from index `at`, of waypoints i and i + 1.
void add_pull(double weight, const Vector3d& r, const Matrix3d& R, int at, int i, BandedQp& qp) {
  qp.hessian().diagonal(i).diagonal().segment<3>(at).array() += weight;
  qp.hessian().diagonal(i + 1).diagonal().segment<3>(at).array() += weight;
  qp.hessian().lower(i).block<3, 3>(at, at) -= weight * R;
  qp.gradient(i).segment<3>(at) -= weight * R.transpose() * r;
  qp.gradient(i + 1).segment<3>(at) += weight * r;
}

}  // namespace

// In a body turned by theta, b becomes b' = b + b x theta.
Vector2d heading_error_model(const Pose& a, const Pose& b, int which, AttitudeMode attitude,
                             Matrix212& J) {
  J.setZero();
  const Matrix3d P = relevant(attitude);
  const Vector3d motion = P * (b.p - a.p);
  const double distance = motion.norm();
  if (distance < kNoDirection) return Vector2d::Zero();
  const Vector3d u = motion / distance;
  const Matrix3d R_BW = (which == 0 ? a.q : b.q).conjugate().toRotationMatrix();
  const Vector3d u_B = R_BW * u;
  Matrix23 by_u_B;
  Vector2d error = off_axis(u_B, by_u_B);
  const Matrix23 by_way = by_u_B * R_BW * (Matrix3d::Identity() - u * u.transpose()) * P / distance;
  J.leftCols<3>() = -by_way;
  J.middleCols<3>(6) = by_way;
  J.middleCols<3>(which == 0 ? 3 : 9) = by_u_B * skew(u_B);
  return error;
}

Vector2d heading_error(const Eigen::Quaterniond& q_WB, const Vector3d& motion_W,
                       AttitudeMode attitude) {
  const Vector3d motion = relevant(attitude) * motion_W;
  if (motion.norm() < kNoDirection) return Vector2d::Zero();
  Matrix23 unused;
  return off_axis(q_WB.conjugate() * motion.normalized(), unused);
}

double SmoothCosts::value(std::span<const Pose> path) const {
  double squares = 0.0;
  double headings = 0.0;
  double turns = 0.0;
  double banks = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Pose& a = path[i];
    const Pose& b = path[i + 1];
    const Vector3d motion = b.p - a.p;
    squares += motion.squaredNorm();
    headings += heading_error(a.q, motion, attitude).squaredNorm() +
                heading_error(b.q, motion, attitude).squaredNorm();
    turns += so3_log(a.q.conjugate() * b.q).squaredNorm();
    banks += sine_of_bank(b.q) * sine_of_bank(b.q);
  }
  const auto segments = static_cast<double>(path.size() - 1);
  return 0.5 * length_weight * (segments * squares / reference_length + reference_length) +
         0.5 * attitude_weight * headings + turn_weight * turns + upright_weight * banks;
}

void SmoothCosts::add_to(std::span<const Pose> path, BandedQp& qp) const {
  const auto segments = static_cast<double>(path.size() - 1);
  const double stretch = 0.5 * length_weight * segments / reference_length;
  for (int i = 0; i + 1 < static_cast<int>(path.size()); ++i) {
    const Pose& a = path[static_cast<std::size_t>(i)];
    const Pose& b = path[static_cast<std::size_t>(i) + 1];

    add_pull(2.0 * stretch, b.p - a.p, Matrix3d::Identity(), 0, i, qp);

    for (const int which : {0, 1}) {
      Matrix212 J;
      const Vector2d error = heading_error_model(a, b, which, attitude, J);
      add_square<2>(0.5 * attitude_weight, error, J, i, qp);
    }

    const Eigen::Quaterniond turn = a.q.conjugate() * b.q;
    add_pull(2.0 * turn_weight, so3_log(turn), turn.conjugate().toRotationMatrix(), 3, i, qp);

    // When the body turns by theta, the z component of y changes by (y x z_B) . theta, with z_B the
    // z axis of W in B.
    const double bank = sine_of_bank(b.q);
    const Vector3d J_bank = Vector3d::UnitY().cross(b.q.conjugate() * Vector3d::UnitZ());
    qp.hessian().diagonal(i + 1).bottomRightCorner<3, 3>() +=
        2.0 * upright_weight * J_bank * J_bank.transpose();
    qp.gradient(i + 1).tail<3>() += 2.0 * upright_weight * bank * J_bank;
  }
}

}  // namespace dive::planning
