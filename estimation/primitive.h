#pragma once
// The primitive estimator: depth from pressure, attitude from the IMU, horizontal position by dead
// reckoning on the speed one expects of the gait commanded. Uses no camera, so it works in the
// dark; its covariance grows with the distance swum.

#include <string>

#include "common/measurements.h"
#include "estimation/state_estimate.h"

namespace dive::estimation {

struct PrimitiveOptions {
  double speed_scale_sigma = 0.01;       ///< One-sigma relative error of the expected speed.
  double heading_bias_sigma_deg = 0.5;   ///< One-sigma constant heading error.
  double attitude_sigma_deg = 0.3;       ///< Roll and pitch, one sigma.
  double depth_sigma_m = 0.01;           ///< Of one depth sample.
  double drift_m_per_sqrt_s = 0.01;      ///< Random walk of horizontal position, per axis.
  double speed_time_constant_s = 1.0;    ///< How fast the speed follows the commanded one.

  /// Empty when usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// Pure: the same calls give the same estimates. Allocates nothing.
class PrimitiveEstimator {
 public:
  /// `position_W` is where the vehicle is put into the water, with standard deviation
  /// `position_sigma_m` per horizontal axis.
  PrimitiveEstimator(PrimitiveOptions options, const Eigen::Vector3d& position_W,
                     double position_sigma_m);

  /// The forward speed commanded from now on, m/s.
  void set_commanded_speed(double speed);
  void add(const ImuSample& sample);
  void add(const DepthSample& sample);
  /// Advances to `now` and returns the estimate.
  [[nodiscard]] const StateEstimate& update(Utime now);

 private:
  PrimitiveOptions options_;
  StateEstimate estimate_;
};

}  // namespace dive::estimation
