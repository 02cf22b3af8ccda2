#include "estimation/visual_inertial/loop_closure/loop_correction.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "estimation/visual_inertial/loop_closure/pose_graph.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;

// Covariance of the filter's motion between two times: the growth of its covariance, or, where an
// update has moved its pose, the reduction.
Matrix4d of_the_way(const Matrix4d& before, const Matrix4d& after, const Eigen::Vector3d& d) {
  const Matrix4d F = carried(d);
  const Matrix4d grown = after - F * before * F.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix4d> eigen(0.5 * (grown + grown.transpose()));
  const Matrix4d& V = eigen.eigenvectors();
  return V * eigen.eigenvalues().cwiseAbs().asDiagonal() * V.transpose();
}

}  // namespace

StateEstimate LoopCorrection::apply(const StateEstimate& filter_now) const {
  StateEstimate result = filter_now;
  result.X_WB = correction * filter_now.X_WB;
  const Matrix3d turn = correction.q.toRotationMatrix();
  Matrix4d turn_4 = Matrix4d::Identity();
  turn_4.topLeftCorner<3, 3>() = turn;
  const Eigen::Vector3d d = filter_now.X_WB.p - filter.p;
  const Matrix4d now = position_and_heading(filter_now.covariance, filter_now.X_WB.q);
  const Matrix4d F = carried(turn * d);
  Matrix4d P = F * covariance * F.transpose() +
               turn_4 * of_the_way(filter_covariance, now, d) * turn_4.transpose();
  if (has_depth) P(2, 2) = std::max(P(2, 2), now(2, 2));
  // Roll and pitch are independent: their correlations with the rest are omitted.
  const Matrix3d R_WB = result.X_WB.q.toRotationMatrix();
  const Matrix3d attitude_W = turn * filter_now.X_WB.q.toRotationMatrix() *
                              filter_now.covariance.bottomRightCorner<3, 3>() *
                              filter_now.X_WB.q.conjugate().toRotationMatrix() * turn.transpose();
  Matrix6d all = Matrix6d::Zero();
  all.topLeftCorner<3, 3>() = P.topLeftCorner<3, 3>();
  all.block<2, 2>(3, 3) = attitude_W.topLeftCorner<2, 2>();
  all(5, 5) = P(3, 3);
  all.block<3, 1>(0, 5) = P.topRightCorner<3, 1>();
  all.block<1, 3>(5, 0) = P.bottomLeftCorner<1, 3>();
  Matrix6d to_body = Matrix6d::Identity();
  to_body.bottomRightCorner<3, 3>() = R_WB.transpose();
  all = to_body * all * to_body.transpose();
  result.covariance = 0.5 * (all + all.transpose());
  return result;
}

}  // namespace dive::estimation
