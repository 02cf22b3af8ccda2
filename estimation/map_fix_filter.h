#pragma once
// Dead reckoning with fixes from a known map: a Kalman filter over the errors that the odometry
// cannot observe, ten states:
//
//   p   horizontal position in the map (2, m)
//   c   heading correction from the compass to the map (rad)
//   s   relative error of the full speed
//   d   error of the declared current u (2, m/s), a slow random walk: the mean of the current is
//       u + d, so that it moves with u
//   b   slip: what the motion model gets wrong, for some seconds (2, m/s, Gauss-Markov in time)
//   m   error of the map around the vehicle (2, m, Gauss-Markov over the distance swum)
//
//   p' = Rz(c) (v_O - u + s (v_O - u + e)) + u + d + b
//
// v_O is the odometry's velocity over ground, which contains u, and e is zero in steady motion: see
// OdometryErrors.
//
// A fix measures p - m and c, and p - m is the position that counts: where the vehicle is among the
// obstacles around it, as they are drawn. Its covariance is published as that of the position in
// the world, P_p + m m', which does not contain the map's turn about its origin. Without m a wall
// that is not where it was drawn would count as measured again with every scan, and the covariance
// would shrink to nothing (a wrong map is not white noise).
//
// A velocity over ground, from cameras or from what two scans show of the surroundings, measures
// the right-hand side of p'.

#include <string>

#include <Eigen/Core>

#include "common/map_fix.h"
#include "common/motion_model.h"

namespace dive::estimation {

struct MapFixOptions {
  /// Least sigma of p at the start, per axis, m: a vehicle is put into the water by hand.
  double start_sigma_m = 0.15;
  double speed_scale_sigma = 0.14;  ///< Sigma of s at the start: drag, thrust known to a fifth.
  double heading_sigma_deg = 2.0;   ///< Sigma of c at the start, deg.
  double heading_walk_deg = 0.1;    ///< Growth of c's sigma, deg per square root of a second.
  double current_sigma = 0.03;      ///< Sigma of d at the start, per axis, m/s.
  double current_walk = 0.001;      ///< Growth of d's sigma, m/s per square root of a second.
  double slip_sigma = MotionModel{}.slip_sigma.maxCoeff();  ///< Sigma of b, per axis, m/s.
  double slip_time_s = MotionModel{}.slip_time_s;           ///< Correlation time of b.
  double map_sigma_m = 0.05;                                ///< Sigma of m, per axis.
  double map_length_m = 3.0;                                ///< Distance over which m changes.
  double drift_m_per_sqrt_s = 0.005;                        ///< Random walk of p, per axis.

  /// Empty if usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// Deterministic. Does not allocate.
class MapFixFilter {
 public:
  /// Demands options that validate.
  explicit MapFixFilter(const MapFixOptions& options);

  /// Begins at `position_W` (m) with covariance `variance` (m^2) per axis.
  void begin(const Eigen::Vector2d& position_W, double variance);
  /// Sets u from now on, m/s. Still water before.
  void set_current(const Eigen::Vector2d& current_W) { declared_W_ = current_W; }
  /// The odometry has moved by `moved_O` (m) in `dt` (s). `excess_O` (m): integral of e.
  /// `blind_variance` (m^2): growth of the variance per axis by what the sensors lack meanwhile.
  void advance(const Eigen::Vector2d& moved_O, const Eigen::Vector2d& excess_O, double dt,
               double blind_variance);
  /// Applies a fix without a problem. `since_O`: motion of the odometry since the scan, m, and
  /// `excess_O` the integral of e (m). Returns the change of position_W(), m.
  Eigen::Vector2d apply(const MapFix& fix, const Eigen::Vector2d& since_O,
                        const Eigen::Vector2d& excess_O);

  /// Applies a velocity over ground (W, m/s) with its information (s^2/m^2), measured while the
  /// odometry moved at `v_O` (m/s) with `excess_O` (e, m/s). False if it is refused: it differs
  /// from the expected velocity by more than three sigmas.
  [[nodiscard]] bool apply_velocity(const Eigen::Vector2d& velocity_W,
                                    const Eigen::Matrix2d& information, const Eigen::Vector2d& v_O,
                                    const Eigen::Vector2d& excess_O);

  /// p - m
  [[nodiscard]] Eigen::Vector2d position_W() const { return x_.head<2>() - x_.segment<2>(kMap); }
  [[nodiscard]] double heading_correction() const { return x_[kHeading]; }
  /// s
  [[nodiscard]] double speed_scale() const { return x_[kScale]; }
  /// u + d, m/s
  [[nodiscard]] Eigen::Vector2d current_W() const { return declared_W_ + x_.segment<2>(kCurrent); }
  /// Velocity that the odometry does not contain, in W, m/s. None while sensors are silent: over
  /// minutes without attitude an error of a centimetre per second would take the estimate out from
  /// under an overhead that the vehicle is still under. The covariance grows by it nevertheless.
  [[nodiscard]] Eigen::Vector2d drift_W() const {
    return is_blind_ ? Eigen::Vector2d::Zero()
                     : Eigen::Vector2d(x_.segment<2>(kCurrent) + slip_W());
  }
  /// b, m/s; none while sensors are silent.
  [[nodiscard]] Eigen::Vector2d slip_W() const {
    return is_blind_ ? Eigen::Vector2d::Zero() : Eigen::Vector2d(x_.segment<2>(kSlip));
  }
  /// Covariance of the errors of position_W() in the world (m) and heading_correction() (rad).
  [[nodiscard]] Eigen::Matrix3d covariance() const;
  /// Covariance of the error of position_W() among the obstacles around it, as they are drawn, m^2.
  [[nodiscard]] Eigen::Matrix2d covariance_among_obstacles() const;

 private:
  static constexpr int kStates = 10;
  static constexpr int kHeading = 2;
  static constexpr int kScale = 3;
  static constexpr int kCurrent = 4;
  static constexpr int kSlip = 6;
  static constexpr int kMap = 8;
  using State = Eigen::Matrix<double, kStates, 1>;
  using Covariance = Eigen::Matrix<double, kStates, kStates>;

  MapFixOptions options_;
  State x_ = State::Zero();
  Covariance P_ = Covariance::Zero();
  Eigen::Vector2d declared_W_ = Eigen::Vector2d::Zero();  ///< u, m/s
  bool is_blind_ = false;  ///< Sensors were silent in the last advance().
};

}  // namespace dive::estimation
