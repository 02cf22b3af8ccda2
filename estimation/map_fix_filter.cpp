#include "estimation/map_fix_filter.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "common/assert.h"
#include "common/range_check.h"
#include "common/se3.h"
#include "estimation/planar.h"

namespace dive::estimation {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kMaxSigmas = 3.0;  // of a velocity that is used

}  // namespace

std::string MapFixOptions::validate() const {
  RangeCheck check;
  check("start_sigma_m", start_sigma_m, 0.0, 100.0);
  check("speed_scale_sigma", speed_scale_sigma, 0.0, 1.0);
  check("heading_sigma_deg", heading_sigma_deg, 0.0, 90.0);
  check("heading_walk_deg", heading_walk_deg, 0.0, 90.0);
  check("current_sigma", current_sigma, 0.0, 5.0);
  check("current_walk", current_walk, 0.0, 1.0);
  check("slip_sigma", slip_sigma, 0.0, 5.0);
  check("slip_time_s", slip_time_s, 0.1, 1000.0);
  check("map_sigma_m", map_sigma_m, 0.0, 10.0);
  check("map_length_m", map_length_m, 0.1, 1000.0);
  check("drift_m_per_sqrt_s", drift_m_per_sqrt_s, 0.0, 1.0);
  return check.problem();
}

MapFixFilter::MapFixFilter(const MapFixOptions& options) : options_(options) {
  DIVE_DEMAND(options_.validate().empty());
}

void MapFixFilter::begin(const Vector2d& position_W, double variance) {
  const MapFixOptions& o = options_;
  x_.setZero();
  x_.head<2>() = position_W;
  P_.setZero();
  P_.diagonal().head<2>().setConstant(std::max(variance, o.start_sigma_m * o.start_sigma_m));
  P_(kHeading, kHeading) = std::pow(deg_to_rad(o.heading_sigma_deg), 2);
  P_(kScale, kScale) = o.speed_scale_sigma * o.speed_scale_sigma;
  P_.diagonal().segment<2>(kCurrent).setConstant(o.current_sigma * o.current_sigma);
  P_.diagonal().segment<2>(kSlip).setConstant(o.slip_sigma * o.slip_sigma);
  P_.diagonal().segment<2>(kMap).setConstant(o.map_sigma_m * o.map_sigma_m);
}

void MapFixFilter::advance(const Vector2d& moved_O, const Vector2d& excess_O, double dt,
                           double blind_variance) {
  const MapFixOptions& o = options_;
  const Vector2d carried_W = declared_W_ * dt;
  const Matrix2d turn = turned(x_[kHeading]);
  const Vector2d by_scale_W = turn * (moved_O - carried_W + excess_O);
  // Through the water.
  const Vector2d moved_W = turn * (moved_O - carried_W) + x_[kScale] * by_scale_W;
  const double slip_kept = std::exp(-dt / o.slip_time_s);
  const double map_kept = std::exp(-(moved_W + carried_W).norm() / o.map_length_m);

  // P becomes F P F', with F the identity except for the rows of position, slip and map error.
  const auto transition = [&](auto&& P) {
    P.row(0) += -moved_W.y() * P.row(kHeading) + by_scale_W.x() * P.row(kScale) +
                dt * (P.row(kCurrent) + P.row(kSlip));
    P.row(1) += moved_W.x() * P.row(kHeading) + by_scale_W.y() * P.row(kScale) +
                dt * (P.row(kCurrent + 1) + P.row(kSlip + 1));
    P.template middleRows<2>(kSlip) *= slip_kept;
    P.template middleRows<2>(kMap) *= map_kept;
  };
  transition(P_);
  transition(P_.transpose());

  is_blind_ = blind_variance > 0.0;
  x_.head<2>() += moved_W + carried_W + drift_W() * dt;
  x_.segment<2>(kSlip) *= slip_kept;
  x_.segment<2>(kMap) *= map_kept;

  P_.diagonal().head<2>().array() +=
      o.drift_m_per_sqrt_s * o.drift_m_per_sqrt_s * dt + blind_variance;
  P_(kHeading, kHeading) += std::pow(deg_to_rad(o.heading_walk_deg), 2) * dt;
  P_.diagonal().segment<2>(kCurrent).array() += o.current_walk * o.current_walk * dt;
  P_.diagonal().segment<2>(kSlip).array() +=
      o.slip_sigma * o.slip_sigma * (1.0 - slip_kept * slip_kept);
  P_.diagonal().segment<2>(kMap).array() +=
      o.map_sigma_m * o.map_sigma_m * (1.0 - map_kept * map_kept);
}

// With information L over y = H x around y_0 and the gradient g there:
//   P+ = P - P H' (I + L H P H')^-1 L H P,   x+ = x + P+ H' (g - L (H x - y_0))
// which needs no inverse of L: it is singular where the scene does not constrain the position.
Vector2d MapFixFilter::apply(const MapFix& fix, const Vector2d& since_O, const Vector2d& excess_O) {
  DIVE_DEMAND(is_well_formed(fix));
  Eigen::Matrix<double, 3, kStates> H = Eigen::Matrix<double, 3, kStates>::Zero();
  H.block<2, 2>(0, 0).setIdentity();
  H.block<2, 2>(0, kMap) = -Matrix2d::Identity();
  H(2, kHeading) = 1.0;
  const Vector2d moved_O = since_O + x_[kScale] * (since_O + excess_O);
  const Vector2d then_W = x_.head<2>() - turned(x_[kHeading]) * moved_O - x_.segment<2>(kMap);
  Vector3d off;
  off.head<2>() = then_W - fix.position_W;
  off[2] = wrap_angle(x_[kHeading] - fix.heading_correction);

  const Eigen::Matrix<double, kStates, 3> PH = P_ * H.transpose();
  const Matrix3d gain =
      (Matrix3d::Identity() + fix.information * (H * PH)).inverse() * fix.information;
  P_ -= (PH * gain * PH.transpose()).eval();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  const State step = P_ * H.transpose() * (fix.gradient - fix.information * off);
  const Vector2d before_W = position_W();
  x_ += step;
  x_[kHeading] = wrap_angle(x_[kHeading]);
  return position_W() - before_W;
}

bool MapFixFilter::apply_velocity(const Vector2d& velocity_W, const Matrix2d& information,
                                  const Vector2d& v_O, const Vector2d& excess_O) {
  DIVE_DEMAND(velocity_W.allFinite() && information.allFinite() && v_O.allFinite());
  const Matrix2d turn = turned(x_[kHeading]);
  const Vector2d by_scale_W = turn * (v_O - declared_W_ + excess_O);
  const Vector2d moving_W = turn * (v_O - declared_W_) + x_[kScale] * by_scale_W;
  Eigen::Matrix<double, 2, kStates> H = Eigen::Matrix<double, 2, kStates>::Zero();
  H.col(kHeading) = Vector2d(-moving_W.y(), moving_W.x());
  H.col(kScale) = by_scale_W;
  H.block<2, 2>(0, kCurrent).setIdentity();
  H.block<2, 2>(0, kSlip).setIdentity();
  const Vector2d off =
      velocity_W - moving_W - declared_W_ - x_.segment<2>(kCurrent) - x_.segment<2>(kSlip);

  // With the information L of the velocity, (H P H' + L^-1)^-1 = (I + L H P H')^-1 L.
  const Eigen::Matrix<double, kStates, 2> PH = P_ * H.transpose();
  const Matrix2d inverse = (Matrix2d::Identity() + information * (H * PH)).inverse() * information;
  if (off.dot(inverse * off) > kMaxSigmas * kMaxSigmas) return false;
  x_ += PH * (inverse * off);
  x_[kHeading] = wrap_angle(x_[kHeading]);
  P_ -= (PH * inverse * PH.transpose()).eval();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  return true;
}

Matrix3d MapFixFilter::covariance() const {
  const Vector2d map = x_.segment<2>(kMap);
  Matrix3d P = P_.topLeftCorner<3, 3>();
  P.topLeftCorner<2, 2>() += map * map.transpose();
  return P;
}

Matrix2d MapFixFilter::covariance_among_obstacles() const {
  const Matrix2d cross = P_.block<2, 2>(0, kMap);
  return P_.topLeftCorner<2, 2>() - cross - cross.transpose() + P_.block<2, 2>(kMap, kMap);
}

}  // namespace dive::estimation
