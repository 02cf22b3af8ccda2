#include "estimation/depth_filter.h"

#include "common/assert.h"

namespace dive::estimation {
namespace {

constexpr double kFirstRateVariance = 0.04;  // (m/s)^2: a vehicle just released into the water

}  // namespace

DepthFilter::DepthFilter(double sample_sigma, double acceleration_sigma, double z)
    : sample_variance_(sample_sigma * sample_sigma),
      acceleration_density_(acceleration_sigma * acceleration_sigma),
      state_{{z, 0.0}, Eigen::Vector2d(sample_variance_, kFirstRateVariance).asDiagonal()} {
  DIVE_DEMAND(sample_sigma > 0.0 && acceleration_sigma > 0.0);
}

DepthFilter::State DepthFilter::predicted(double dt) const {
  Eigen::Matrix2d F;
  F << 1.0, dt, 0.0, 1.0;
  Eigen::Matrix2d Q;
  Q << dt * dt * dt / 3.0, dt * dt / 2.0, dt * dt / 2.0, dt;
  return {F * state_.mean, F * state_.covariance * F.transpose() + acceleration_density_ * Q};
}

void DepthFilter::add(Utime utime, double z) {
  if (!started_) {
    started_ = true;
    utime_ = utime;
    state_.mean = {z, 0.0};
    return;
  }
  if (utime <= utime_) return;
  state_ = predicted(to_seconds(utime - utime_));
  utime_ = utime;
  // H = [1 0]; Joseph's form keeps the covariance symmetric and positive.
  const Eigen::Vector2d gain =
      state_.covariance.col(0) / (state_.covariance(0, 0) + sample_variance_);
  state_.mean += gain * (z - state_.mean[0]);
  Eigen::Matrix2d left = Eigen::Matrix2d::Identity();
  left.col(0) -= gain;
  state_.covariance =
      left * state_.covariance * left.transpose() + sample_variance_ * gain * gain.transpose();
}

DepthFilter::Height DepthFilter::at(Utime utime) const {
  const State state = started_ && utime > utime_ ? predicted(to_seconds(utime - utime_)) : state_;
  return {state.mean[0], state.mean[1], state.covariance(0, 0)};
}

}  // namespace dive::estimation
