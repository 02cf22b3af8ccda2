#pragma once
// Height and its rate from pressure: a Kalman filter of two states under white acceleration
// (Bar-Shalom, Li, Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation",
// 6.2.2).

#include <Eigen/Core>

#include "common/clock.h"

namespace dive::estimation {

class DepthFilter {
 public:
  /// One-sigma noise of a sample (m) and of the acceleration to follow (m/s^2, constant for a
  /// second); `z` (m, up) is the height until the first sample.
  DepthFilter(double sample_sigma, double acceleration_sigma, double z);

  /// Height `z` (m) measured at `utime`; ignored if older than the last one.
  void add(Utime utime, double z);
  [[nodiscard]] bool started() const { return started_; }
  /// Time of the last sample.
  [[nodiscard]] Utime last() const { return utime_; }

  struct Height {
    double z = 0.0;         ///< m
    double rate = 0.0;      ///< m/s
    double variance = 0.0;  ///< Variance of z, m^2.
  };
  /// Height at `utime`, not before the last sample.
  [[nodiscard]] Height at(Utime utime) const;

 private:
  struct State {
    Eigen::Vector2d mean;  ///< z, rate
    Eigen::Matrix2d covariance;
  };
  [[nodiscard]] State predicted(double dt) const;

  double sample_variance_;
  double acceleration_density_;
  State state_;
  Utime utime_ = 0;
  bool started_ = false;
};

}  // namespace dive::estimation
