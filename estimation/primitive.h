#pragma once
// The primitive estimator: depth from pressure, attitude from the IMU, horizontal position by dead
// reckoning on the speed one expects of the gait commanded. Uses no camera, so it works in the
// dark; its covariance grows with the distance swum.
//
// Two errors are constant over a dive and never observed: the heading is off by b, the gait's speed
// by a share s. With D the horizontal displacement reckoned since the start and D' that turned by
// +90 degrees, the true position is p + s D - b D' to first order, so that
//
//   P_xy = sigma_0^2 I + sigma_s^2 D D^T + sigma_b^2 D' D'^T + q t I
//
// which is what a Kalman filter with the states [p_xy, b, s] propagates, in closed form. It grows
// with the distance from the start, not with the distance swum: whoever swims back, undoes his
// errors.

#include <optional>
#include <string>

#include "common/measurements.h"
#include "estimation/depth_filter.h"
#include "estimation/motion_model.h"
#include "estimation/state_estimate.h"

namespace dive::estimation {

struct PrimitiveOptions {
  double speed_scale_sigma = 0.01;      ///< One-sigma relative error of the expected speed.
  double heading_bias_sigma_deg = 0.5;  ///< One-sigma constant heading error.
  double attitude_sigma_deg = 0.3;      ///< Of one attitude sample, per axis, one sigma.
  double depth_sigma_m = 0.01;          ///< Of one depth sample.
  double vertical_acceleration = 0.05;  ///< m/s^2, one sigma: what the depth filter must follow.
  double drift_m_per_sqrt_s = 0.005;    ///< Random walk of horizontal position, per axis.
  MotionModel motion;

  /// Empty when usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// Pure: the same calls give the same estimates. Allocates nothing.
class PrimitiveEstimator {
 public:
  /// `position_W` is where the vehicle is put into the water, at rest, with standard deviation
  /// `position_sigma_m` per horizontal axis.
  PrimitiveEstimator(PrimitiveOptions options, const Eigen::Vector3d& position_W,
                     double position_sigma_m);

  /// The forward speed commanded from now on, m/s.
  void set_commanded_speed(double speed);
  /// The climb rate to be expected from what the flippers are told beside that, m/s: what is
  /// reckoned with while the depth sensor is silent.
  void set_expected_heave(double heave);
  /// The vehicle went on while nobody reckoned: by so much horizontally (m), with so much doubt
  /// (one sigma, m), and it still swims at `surge` (m/s).
  void went_on(const Eigen::Vector2d& by_W, double sigma_m, double surge);
  /// By what is seen around it the vehicle is so far (m) from where it was thought to be. That
  /// holds it to a map it has made itself, and says nothing of where the map is: the covariance
  /// stays. Who is off in the same direction again and again is not where it was thought to be
  /// because it is faster than was thought: the displacements d told, low-passed over T = 1 s,
  ///   T s' = -s + sum of d delta(t),
  /// are added to the velocity published. They are not reckoned with: along a smooth wall what is
  /// seen says that nothing moves, and whoever believed his own map in that would come to rest.
  void moved(const Eigen::Vector2d& by_W);
  /// Samples that are not finite or older than the last one are ignored.
  void add(const ImuSample& sample);
  void add(const DepthSample& sample);
  /// Advances to `now` and returns the estimate. Time must not run backwards.
  [[nodiscard]] const StateEstimate& update(Utime now);

 private:
  void reckon(double dt);
  [[nodiscard]] Eigen::Quaterniond attitude(Utime now) const;
  [[nodiscard]] Eigen::Vector3d velocity_B() const;
  void fill_covariance();

  PrimitiveOptions options_;
  ExpectedMotion motion_;
  DepthFilter depth_;
  double commanded_speed_ = 0.0;
  double expected_heave_ = 0.0;
  double silence_s_ = 0.0;  ///< That the height has been reckoned for.
  double start_variance_;   ///< m^2
  Eigen::Vector2d displacement_W_ = Eigen::Vector2d::Zero();  ///< D, m
  Eigen::Vector2d slip_W_ = Eigen::Vector2d::Zero();          ///< s, m/s
  double elapsed_s_ = 0.0;
  std::optional<ImuSample> imu_;
  StateEstimate estimate_;
};

}  // namespace dive::estimation
