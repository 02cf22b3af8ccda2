#pragma once
// The primitive estimator: depth from pressure, attitude from the AHRS, horizontal position by dead
// reckoning with the expected speed of the commanded gait. Needs no camera, so it works in the
// dark; its covariance grows with the distance swum.
//
// Two errors are constant over a dive and never observed: the heading is off by b, the gait's speed
// by a relative error s. With D the horizontal displacement by dead reckoning since the start and
// D' that vector turned by +90 degrees, the true position is p + s D - b D' to first order, so that
//
//   P_xy = sigma_0^2 I + sigma_s^2 D D^T + sigma_b^2 D' D'^T + q t I + sigma_c^2 t^2 I
//
// which is what a Kalman filter with the states [p_xy, b, s, c] propagates, in closed form. It
// grows with the distance from the start, not with the distance swum: swimming back cancels the
// errors.
//
// The current is a state that is never observed here: its mean is the declared one of the moment
// (set_current()), which carries the position over ground, and its error c is constant. D is
// through the water.

#include <optional>
#include <string>

#include "common/measurements.h"
#include "estimation/depth_filter.h"
#include "estimation/expected_motion.h"
#include "estimation/state_estimate.h"

namespace dive::estimation {

struct PrimitiveOptions {
  double speed_scale_sigma = 0.08;      ///< One-sigma relative error of the expected speed.
  double heading_bias_sigma_deg = 1.8;  ///< One-sigma constant heading error.
  double attitude_sigma_deg = 0.3;      ///< One-sigma noise of one attitude sample, per axis.
  double depth_sigma_m = 0.01;          ///< One-sigma noise of one depth sample.
  double depth_bias_sigma_m = 0.03;     ///< One-sigma constant error: tide, air pressure, density.
  double vertical_acceleration = 0.05;  ///< One-sigma acceleration of the depth filter, m/s^2.
  double drift_m_per_sqrt_s = 0.03;     ///< Random walk of horizontal position, per axis.
  double current_sigma = 0.0;           ///< One-sigma error of the current, per axis, m/s.
  MotionModel motion;

  /// Empty if usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// What is known of the errors of dead reckoning.
struct OdometryErrors {
  double blind_variance = 0.0;  ///< Of the position per axis, from times without samples, m^2.
  /// If the vehicle's full speed is wrong by a share s, its velocity through the water is wrong by
  /// s (v + excess): what that is beyond v, horizontally, m/s, and its integral, m. Zero in steady
  /// motion.
  Eigen::Vector2d excess_velocity_W = Eigen::Vector2d::Zero();
  Eigen::Vector2d excess_W = Eigen::Vector2d::Zero();
};

/// Deterministic: the same calls give the same estimates. Does not allocate.
class PrimitiveEstimator {
 public:
  /// `position_W` is the position of release, at rest, with standard deviation `position_sigma_m`
  /// per horizontal axis.
  PrimitiveEstimator(const PrimitiveOptions& options, const Eigen::Vector3d& position_W,
                     double position_sigma_m);

  /// Sets the forward speed commanded from now on, m/s: where the efforts are not known.
  void set_commanded_speed(double speed);
  /// Sets the efforts of the flippers in surge and heave from now on, each in [-1, 1].
  void set_efforts(double surge, double heave);
  /// Sets the climb rate expected from the other commands, m/s: used for dead reckoning while there
  /// are no depth samples.
  void set_expected_heave(double heave);
  /// Sets the expected velocity of the water over ground from now on, m/s. Still water before.
  void set_current(const Eigen::Vector2d& current_W);
  /// Adds motion during an interruption: `by_W` horizontally (m), with uncertainty `sigma_m` (one
  /// sigma, m), and a present speed of `surge` (m/s).
  void dead_reckon(const Eigen::Vector2d& by_W, double sigma_m, double surge);
  /// Replaces the expected velocity through the water (in B, m/s) by a better estimate of it.
  void set_velocity(const Eigen::Vector3d& v_B);
  /// Ignores samples that are not finite or are older than the last one.
  void add(const ImuSample& sample);
  void add(const DepthSample& sample);
  /// Used without attitude samples: attitude and turn rate (rad/s) at `utime` as predicted from the
  /// efforts of the flippers. Uncertainty grows until a sample arrives.
  void predict_attitude(Utime utime, const Eigen::Quaterniond& q_WB,
                        const Eigen::Vector3d& omega_B);
  /// Advances to `now` and returns the estimate. Demands non-decreasing times.
  [[nodiscard]] const StateEstimate& update(Utime now);
  /// Velocity of the water over ground that was set, m/s.
  [[nodiscard]] const Eigen::Vector2d& current_W() const { return current_W_; }
  /// Expected velocity through the water, in B, m/s.
  [[nodiscard]] Eigen::Vector3d v_B() const { return motion_.v_B(); }
  /// Change of v_B() per relative error of the vehicle's full speed, m/s.
  [[nodiscard]] Eigen::Vector3d by_scale_B() const { return motion_.by_scale_B(); }
  /// Their blind variance contains that of the start.
  [[nodiscard]] OdometryErrors errors() const;

 private:
  void observe_gyro_bias(const ImuSample& before);
  void propagate(double dt);
  void grow_blind(double dt);
  [[nodiscard]] Eigen::Quaterniond attitude(Utime now) const;
  [[nodiscard]] Eigen::Vector3d velocity_B() const;
  [[nodiscard]] Eigen::Vector2d excess_velocity_W() const;
  void fill_covariance();

  PrimitiveOptions options_;
  ExpectedMotion motion_;
  DepthFilter depth_;
  Propulsion propulsion_;
  Eigen::Vector3d gyro_bias_B_ = Eigen::Vector3d::Zero();  ///< rad/s, by the measured attitudes.
  double expected_heave_ = 0.0;
  double silence_s_ = 0.0;  ///< Time for which the height has been dead-reckoned.
  double blind_s_ = 0.0;    ///< Time for which the attitude has been predicted, s.
  bool is_blind_ = false;   ///< True while the attitude is predicted.
  Utime measured_ = 0;      ///< Time of the last attitude sample, us.
  double start_variance_;   ///< Position variance at the start, m^2.
  Eigen::Vector2d current_W_ = Eigen::Vector2d::Zero();       ///< m/s
  Eigen::Vector2d displacement_W_ = Eigen::Vector2d::Zero();  ///< D, m
  Eigen::Vector2d excess_W_ = Eigen::Vector2d::Zero();        ///< As in OdometryErrors.
  double elapsed_s_ = 0.0;
  std::optional<ImuSample> imu_;
  StateEstimate estimate_;
};

}  // namespace dive::estimation
