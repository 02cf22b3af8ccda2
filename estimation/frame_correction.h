#pragma once
// The correction from odometry to the map, and the one place where it is estimated and applied.
// (Frames as in REP 105 of the ROS community, "Coordinate Frames for Mobile Platforms": the pose in
// odom moves without jumps but drifts; localisation owns map <- odom.)
//
// The odometry is the primitive estimator's dead reckoning. Sources propose the position of the
// vehicle:
//
//   vision         a pose in the map at the time of an image, with a covariance
//   map alignment  a horizontal shift by which a range scan fits the observed map
//   map fix        the information of a range scan on position and heading in the known map
//
// The correction has four degrees of freedom, a heading c, two coordinates and their rate; height,
// roll and pitch are the odometry's, whose depth and attitude are measured:
//
//   p_map(t) = b + Rz(c) (p_odom(t) - a) + d (t - t_f) + o(t)      horizontally
//   q_map(t) = Rz(c) q_odom(t)
//
// a is the odometry's position at t_f, the time of vision's last image, b is vision's position
// then, and d the difference of their velocities, which is mostly the current, or its difference to
// the declared one, which the odometry contains (set_current()). Whenever b changes,
// o takes up the difference and goes to zero at a bounded speed, and c approaches vision's heading
// likewise: no source makes the published pose jump except the map alignment, which is applied at
// once, and a loop closure that moves the observed map (move()). When vision is lost everything
// keeps its value, and d becomes its mean over the last seconds: a current persists, and only
// cameras measure it.
//
// Covariance. With vision: that of vision, and o o^T. Without: with the displacement D since then,
// D' that vector turned by +90 degrees, and e the error in heading, the position error grows by s D
// + e D' and by the effect of the current (see primitive.h).
//
// In a known map the third source are fixes, see map_fix_filter.h, which then estimates b, c and d
// and their covariance in the place of vision. A fix that moves b by less than `max_smooth_m` is
// taken up by o as well; a larger one is applied at once, and has_jumped() says so. Of vision that
// filter gets the velocity over ground, and not the position, which drifts and is no better than
// the first one. Of two ambiguous fixes in a row it gets the velocity too: each may be of the wrong
// place, but their difference is how the vehicle moved between them.
//
// The map alignment keeps the vehicle consistent with a map that it made itself and gives no
// information on where that map is: the covariance stays. Repeated shifts in one direction mean an
// unmodelled velocity: low-passed over T, T s' = -s + sum of shifts delta(t), they are added to the
// velocity published while vision does not measure it. The position does not integrate them: along
// a smooth wall the alignment reports no motion, and the vehicle would come to rest in its own map.

#include <cstddef>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "common/map_fix.h"
#include "common/planar_transform.h"
#include "common/timed_buffer.h"
#include "estimation/map_fix_filter.h"
#include "estimation/primitive.h"
#include "estimation/state_estimate.h"
#include "estimation/vision_estimate.h"
#include "estimation/vision_gate.h"

namespace dive::estimation {

struct FrameCorrectionOptions {
  VisionGateOptions gate;
  double approach = 0.15;        ///< Speed at which o goes to zero, m/s.
  double approach_deg = 3.0;     ///< Rate at which c goes to vision's heading, deg/s.
  double drift_time_s = 4.0;     ///< Averaging time of d for the loss of vision.
  double max_drift = 0.4;        ///< Bound of that mean, m/s: the maximum current.
  double drift_memory_s = 60.0;  ///< Time constant of the decay of d without vision.
  double drift_sigma = 0.01;     ///< Constant part of the sigma of d without vision, m/s.
  double drift_share = 0.1;      ///< Sigma of d without vision as a fraction of d.
  double slip_time_s = 1.0;      ///< T of the low-pass over map alignments.
  double max_slip = 0.3;         ///< Bound of the velocity that alignments add, m/s.
  double max_smooth_m = 0.3;     ///< A fix that moves the position by more is applied at once.
  double jump_m = 0.1;           ///< A loop that moves the position by more is a jump.
  double vision_period_s = 0.5;  ///< Least time between two velocities of vision beside fixes.
  double vision_sigma = 0.02;    ///< Standard deviation of that velocity, per axis, m/s.
  double scan_period_s = 1.2;    ///< Longest time between two ambiguous fixes that are compared.
  /// Present: fixes from a known map are used, of vision the velocity, and no map alignments.
  std::optional<MapFixOptions> fixes = {};

  /// Empty if usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// What motion through the water lacks, as far as it is declared or as fixes or cameras have
/// measured it.
struct UnmodelledMotion {
  double speed_scale = 0.0;                             ///< Relative error of the full speed.
  Eigen::Vector2d current_W = Eigen::Vector2d::Zero();  ///< m/s
  /// Error of the velocity through the water, which lasts some seconds, m/s.
  Eigen::Vector2d slip_W = Eigen::Vector2d::Zero();
};

/// Deterministic: the same calls give the same estimates. Does not allocate.
class FrameCorrection {
 public:
  /// Demands options that validate.
  FrameCorrection(const FrameCorrectionOptions& options, const PrimitiveOptions& odometry);

  /// Proposes an estimate of vision that arrived at `now`, before the update() of that tick.
  /// Rejected: values that are not finite, not later than the last, implausible or too old.
  void propose(Utime now, const VisionEstimate& vision);
  /// The vehicle is `by_W` (m) from its published position according to the observed map. Applied
  /// at once. Vision's frame moves with it, so that vision does not pull back.
  void propose_alignment(const Eigen::Vector2d& by_W);
  /// A closed loop moves the vehicle and the map around it: what was at p_W is at `by` * p_W from
  /// now on. Applied at once. Vision's frame moves with it. Demands options without fixes.
  void move(const PlanarTransform& by);
  /// Proposes a fix. Demands options with fixes. False if its position was not used: it has a
  /// problem, or its scan is older than the stored poses or newer than the last.
  [[nodiscard]] bool propose(const MapFix& fix);
  /// Sets the declared current that the odometry contains from now on, m/s. Still water before.
  void set_current(const Eigen::Vector2d& current_W);
  /// Called every tick with the pose in odom and what is known of its errors; returns the pose in
  /// the map. Demands non-decreasing times.
  [[nodiscard]] const StateEstimate& update(const StateEstimate& odometry,
                                            const OdometryErrors& errors = {});
  /// True if since the last but one update() a fix was applied at once, or a loop moved the vehicle
  /// by more than `jump_m`.
  [[nodiscard]] bool has_jumped() const { return has_jumped_; }

  [[nodiscard]] const StateEstimate& estimate() const { return estimate_; }
  /// Covariance of the published horizontal position among the obstacles of the known map, as they
  /// are drawn, m^2; empty without fixes.
  [[nodiscard]] std::optional<Eigen::Matrix2d> covariance_among_obstacles() const;
  /// What dead reckoning from estimate() must add to stay true; zero if nothing measures it.
  [[nodiscard]] UnmodelledMotion unmodelled() const;
  /// Why vision is not used, as of its last update; kNone while it is.
  [[nodiscard]] VisionFault fault() const { return gate_.fault(); }

 private:
  struct Past {
    OdometryState odometry;
    PlanarTransform aligned;  ///< By map alignments and loops so far.
  };
  static constexpr std::size_t kPast = 256;  ///< Number of ticks, five seconds.

  [[nodiscard]] std::optional<OdometryState> odometry_at(Utime utime) const;
  void follow(const StateEstimate& vision, const OdometryState& then);
  void follow_velocity(const StateEstimate& vision, const OdometryState& then);
  void follow_surroundings(const MapFix& fix, const OdometryState& then);
  void release();
  void shift(const PlanarTransform& by);
  void advance(const Eigen::Vector2d& moved_O, const Eigen::Vector2d& excess_O,
               double blind_variance, double dt);
  void publish(const StateEstimate& odometry);
  void publish_corrected(const StateEstimate& odometry);
  void publish_aligned();
  [[nodiscard]] Eigen::Vector2d unmodelled_velocity_W() const;
  [[nodiscard]] Eigen::Vector2d displacement() const;
  [[nodiscard]] Eigen::Vector2d target() const;
  [[nodiscard]] Eigen::Matrix3d uncertainty() const;

  FrameCorrectionOptions options_;
  PrimitiveOptions odometry_;
  VisionGate gate_;
  /// An ambiguous fix: where its scan alone places the vehicle, if it is the right place.
  struct Ambiguous {
    Utime utime = 0;
    Eigen::Vector2d position_W;
    Eigen::Matrix2d information;
    Eigen::Vector2d p_O;  ///< The odometry's position then, m.
    Eigen::Vector2d excess_O;
  };
  Eigen::Vector2d declared_W_ = Eigen::Vector2d::Zero();  ///< Declared current, m/s.
  std::optional<MapFixFilter> filter_;                    ///< With fixes.
  std::optional<Ambiguous> ambiguous_;                    ///< The last fix, if it was ambiguous.
  std::optional<Utime> seen_;  ///< Time of the last velocity of vision beside fixes, us.
  TimedBuffer<Past, kPast> past_;
  StateEstimate estimate_;
  bool has_jumped_ = false;
  bool jumps_ = false;           ///< The same since the last update().
  double blind_variance_ = 0.0;  ///< Variance added at the last update(), m^2.
  bool follows_vision_ = false;  ///< True once vision was accepted: the equation above holds.

  Utime anchor_utime_ = 0;                                  ///< t_f, us
  Eigen::Vector2d anchor_O_ = Eigen::Vector2d::Zero();      ///< a, m
  Eigen::Vector2d base_W_ = Eigen::Vector2d::Zero();        ///< b + d (t - t_f), m
  Eigen::Vector2d drift_W_ = Eigen::Vector2d::Zero();       ///< d, m/s
  Eigen::Vector2d offset_W_ = Eigen::Vector2d::Zero();      ///< o, m
  double yaw_ = 0.0;                                        ///< c, rad
  double yaw_target_ = 0.0;                                 ///< Value of c by vision, rad.
  Eigen::Vector2d mean_drift_W_ = Eigen::Vector2d::Zero();  ///< Mean of d with vision, m/s.
  double averaged_s_ = 0.0;                                 ///< Averaging time, <= drift_time_s.
  double drift_deviation_ = 0.0;  ///< Difference of d and its mean at the loss of vision, m/s.
  /// Covariance of x, y (W, m) and heading (rad) at t_f.
  Eigen::Matrix3d base_covariance_ = Eigen::Matrix3d::Zero();
  Eigen::Vector2d slip_W_ = Eigen::Vector2d::Zero();  ///< s, m/s
  PlanarTransform aligned_;                           ///< By map alignments and loops so far.
  /// The same when vision's filter was initialised from the published pose.
  PlanarTransform aligned_at_init_;
  std::optional<Utime> init_utime_;  ///< Initialisation time of vision's filter, us.
};

}  // namespace dive::estimation
