#include "estimation/motion_fit/window_problem.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "common/assert.h"
#include "estimation/expected_motion.h"
#include "estimation/planar.h"

namespace dive::estimation {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kRunIn = 2.0;          // s over which the thrust's lag is followed up to a window
constexpr double kFixSigma = 0.02;      // m: objects are not drawn better than that
constexpr double kHeightSigma = 0.005;  // m, of a mean of a fifth of a second
constexpr double kMinInformation = 1e-6;

// Steps of the numerical derivatives.
constexpr double kStepLog = 1e-3;
constexpr double kStepLinear = 1e-4;
constexpr double kStepVelocity = 1e-3;  // m/s
constexpr double kStepSpeed = 1e-3;

}  // namespace

WindowUnknowns moved(const WindowUnknowns& unknowns, const WindowVector& step) {
  WindowUnknowns result = unknowns;
  result.position_W += step.head<2>();
  result.height += step[2];
  result.v_B += step.segment<3>(3);
  result.heading_correction += step[6];
  return result;
}

WindowProblem::WindowProblem(const MotionWindow& window, std::span<const DrivenTick> ticks)
    : window_(window), ticks_(ticks) {
  const Vector3d floor = Vector3d(kFixSigma, kFixSigma, 0.0).cwiseAbs2();
  for (const MapFix& fix : window.fixes) {
    // The information and the gradient of a fix whose position has the variance `floor` more.
    const Matrix3d less = (Matrix3d::Identity() + fix.information * floor.asDiagonal()).inverse();
    Matrix3d information = less * fix.information;
    information = (0.5 * (information + information.transpose())).eval();
    const Vector3d gradient = less * fix.gradient;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(information);
    Matrix3d root = Matrix3d::Zero();
    Vector3d scaled = Vector3d::Zero();
    for (int i = 0; i < 3; ++i) {
      const double value = eigen.eigenvalues()[i];
      if (value < kMinInformation) continue;
      root.row(i) = std::sqrt(value) * eigen.eigenvectors().col(i).transpose();
      scaled[i] = eigen.eigenvectors().col(i).dot(gradient) / std::sqrt(value);
    }
    roots_.push_back(root);
    gradients_.push_back(scaled);
  }
}

double WindowProblem::time(Utime utime) const {
  return to_seconds(utime - ticks_[window_.first].utime);
}

// The thrust at the start, by the efforts before it.
Vector2d WindowProblem::lagged_efforts(double lag_s) const {
  std::size_t begin = window_.first;
  while (begin > 0 && ticks_[begin].dt < 0.1 &&
         to_seconds(ticks_[window_.first].utime - ticks_[begin].utime) < kRunIn) {
    --begin;
  }
  Vector2d lagged = ticks_[begin].efforts;
  for (std::size_t i = begin + 1; i <= window_.first; ++i) {
    lagged += -std::expm1(-ticks_[i].dt / std::max(lag_s, 1e-9)) * (ticks_[i].efforts - lagged);
  }
  return lagged;
}

VectorXd WindowProblem::motion(const MotionModel& model, double speed_error,
                               const Vector3d& v_B) const {
  const auto fixes = static_cast<Index>(window_.fixes.size());
  VectorXd at(2 * fixes + static_cast<Index>(window_.heights.size()));
  const double scale = (1.0 + speed_error) * (1.0 + speed_error);
  const auto thrust = [&](Vector2d efforts) {
    efforts.x() *= scale;
    return efforts;
  };
  ExpectedMotion expected(model);
  expected.begin_at(v_B, thrust(lagged_efforts(model.thrust_lag_s)));
  Vector3d x = Vector3d::Zero();
  std::size_t fix = 0;
  std::size_t height = 0;
  for (std::size_t i = window_.first; i <= window_.last; ++i) {
    const DrivenTick& tick = ticks_[i];
    const Vector3d before = x;
    if (i > window_.first) {
      const Vector3d v_before = expected.v_B();
      const Vector3d up_B = tick.q_WB.conjugate() * Vector3d::UnitZ();
      expected.advance({.speed = 0.0, .efforts = thrust(tick.efforts)}, tick.omega_B, up_B,
                       tick.dt);
      x += 0.5 * tick.dt * (tick.q_WB * (v_before + expected.v_B()));
    }
    const auto share = [&](Utime utime) {
      return i == window_.first ? 1.0 : 1.0 - to_seconds(tick.utime - utime) / tick.dt;
    };
    for (; fix < window_.fixes.size() && window_.fixes[fix].scan_utime <= tick.utime; ++fix) {
      const double part = share(window_.fixes[fix].scan_utime);
      at.segment<2>(2 * static_cast<Index>(fix)) = (before + part * (x - before)).head<2>();
    }
    for (; height < window_.heights.size() && window_.heights[height].utime <= tick.utime;
         ++height) {
      const double part = share(window_.heights[height].utime);
      at[2 * fixes + static_cast<Index>(height)] = before.z() + part * (x.z() - before.z());
    }
  }
  DIVE_DEMAND(fix == window_.fixes.size() && height == window_.heights.size());
  return at;
}

VectorXd WindowProblem::residuals(const VectorXd& motion, const DiveUnknowns& dive,
                                  const WindowUnknowns& unknowns) const {
  const auto fixes = static_cast<Index>(window_.fixes.size());
  const auto heights = static_cast<Index>(window_.heights.size());
  const Eigen::Matrix2d R = turned(unknowns.heading_correction);
  VectorXd r(3 * fixes + heights);
  for (Index i = 0; i < fixes; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const MapFix& fix = window_.fixes[k];
    const Vector2d p_W =
        unknowns.position_W + R * motion.segment<2>(2 * i) + dive.current_W * time(fix.scan_utime);
    Vector3d off;
    off << p_W - fix.position_W, wrap_angle(unknowns.heading_correction - fix.heading_correction);
    r.segment<3>(3 * i) = roots_[k] * off - gradients_[k];
  }
  for (Index i = 0; i < heights; ++i) {
    const double z = unknowns.height + motion[2 * fixes + i];
    r[3 * fixes + i] = (z - window_.heights[static_cast<std::size_t>(i)].z) / kHeightSigma;
  }
  return r;
}

VectorXd WindowProblem::residuals(const MotionModel& model, const DiveUnknowns& dive,
                                  const WindowUnknowns& unknowns) const {
  return residuals(motion(model, dive.speed_error, unknowns.v_B), dive, unknowns);
}

Residuals WindowProblem::linearised(const MotionModel& model, const DiveUnknowns& dive,
                                    const WindowUnknowns& unknowns, std::span<const int> free,
                                    std::span<const bool> is_log) const {
  const VectorXd x = motion(model, dive.speed_error, unknowns.v_B);
  const auto n = static_cast<Index>(free.size());
  Residuals result;
  result.r = residuals(x, dive, unknowns);
  result.by_model = MatrixXd::Zero(result.r.size(), n + kDiveUnknowns);
  result.by_window = MatrixXd::Zero(result.r.size(), kWindowUnknowns);
  // All residuals are linear in x, and in position, height and current.
  const auto difference = [&](const VectorXd& high, const VectorXd& low, double step) {
    return VectorXd((residuals(high, dive, unknowns) - residuals(low, dive, unknowns)) /
                    (2.0 * step));
  };
  for (Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(free[static_cast<std::size_t>(k)]);
    const MotionCoefficient& c = motion_coefficients()[i];
    const double step = is_log[i] ? kStepLog : kStepLinear;
    MotionModel high = model;
    MotionModel low = model;
    c.of(high) = is_log[i] ? c.value(model) * std::exp(step) : c.value(model) + step;
    c.of(low) = is_log[i] ? c.value(model) * std::exp(-step) : c.value(model) - step;
    result.by_model.col(k) = difference(motion(high, dive.speed_error, unknowns.v_B),
                                        motion(low, dive.speed_error, unknowns.v_B), step);
  }
  result.by_model.col(n + 2) =
      difference(motion(model, dive.speed_error + kStepSpeed, unknowns.v_B),
                 motion(model, dive.speed_error - kStepSpeed, unknowns.v_B), kStepSpeed);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = kStepVelocity * Vector3d::Unit(axis);
    result.by_window.col(3 + axis) =
        difference(motion(model, dive.speed_error, unknowns.v_B + step),
                   motion(model, dive.speed_error, unknowns.v_B - step), kStepVelocity);
  }
  const auto fixes = static_cast<Index>(window_.fixes.size());
  const Eigen::Matrix2d R = turned(unknowns.heading_correction);
  for (Index i = 0; i < fixes; ++i) {
    const Matrix3d& root = roots_[static_cast<std::size_t>(i)];
    const double t = time(window_.fixes[static_cast<std::size_t>(i)].scan_utime);
    const Vector2d turned_x = R * x.segment<2>(2 * i);
    result.by_model.block<3, 2>(3 * i, n) = t * root.leftCols<2>();
    result.by_window.block<3, 2>(3 * i, 0) = root.leftCols<2>();
    result.by_window.block<3, 1>(3 * i, 6) = root * Vector3d(-turned_x.y(), turned_x.x(), 1.0);
  }
  result.by_window.col(2)
      .tail(static_cast<Index>(window_.heights.size()))
      .setConstant(1.0 / kHeightSigma);
  return result;
}

WindowUnknowns WindowProblem::guess() const {
  WindowUnknowns unknowns;
  const MapFix& first = window_.fixes.front();
  const MapFix& last = window_.fixes.back();
  unknowns.position_W = first.position_W;
  unknowns.height = window_.heights.front().z;
  unknowns.heading_correction = first.heading_correction;
  const double dt = std::max(to_seconds(last.scan_utime - first.scan_utime), 1.0);
  Vector3d v_W = Vector3d::Zero();
  v_W.head<2>() =
      turned(first.heading_correction).transpose() * (last.position_W - first.position_W) / dt;
  const Vector3d v_B = ticks_[window_.first].q_WB.conjugate() * v_W;
  unknowns.v_B.x() = v_B.x();
  return unknowns;
}

}  // namespace dive::estimation
