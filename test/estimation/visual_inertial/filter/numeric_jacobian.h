#pragma once
// Derivatives by central differences, to test those in closed form.

#include <functional>

#include <Eigen/Core>

namespace dive::testing {

/// f: an error (size n) to a result; one column per entry of the error, at zero.
inline Eigen::MatrixXd numeric_jacobian(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f, Eigen::Index n,
    double step = 1e-5) {
  Eigen::MatrixXd J(f(Eigen::VectorXd::Zero(n)).size(), n);
  for (Eigen::Index i = 0; i < n; ++i) {
    Eigen::VectorXd e = Eigen::VectorXd::Zero(n);
    e[i] = step;
    const Eigen::VectorXd after = f(e);
    e[i] = -step;
    J.col(i) = (after - f(e)) / (2.0 * step);
  }
  return J;
}

/// The rotation vector of `from`^-1 `to`.
inline Eigen::Vector3d turned(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  const Eigen::AngleAxisd turn(from.conjugate() * to);
  return turn.angle() * turn.axis();
}

inline Eigen::Quaterniond turn_by(const Eigen::Quaterniond& q, const Eigen::Vector3d& by) {
  const double angle = by.norm();
  if (angle == 0.0) return q;
  return q * Eigen::Quaterniond(Eigen::AngleAxisd(angle, by / angle));
}

}  // namespace dive::testing
