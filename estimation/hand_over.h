#pragma once
// Hand-over between the primitive and the visual-inertial estimator, without a jump in what is
// published. (Frames as in REP 105 of the ROS community, "Coordinate Frames for Mobile Platforms":
// what moves without jumps, and what corrects it.)
//
// Vision says every now and then, and late, where the vehicle was; the primitive estimator says at
// every tick how it has moved since. What is published has four degrees of freedom of its own, a
// heading and two coordinates; height, roll and pitch are the primitive estimator's, whose depth
// and attitude are measured:
//
//   p_pub(t) = b + Rz(c) (p_prim(t) - a) + d (t - t_f) + o(t)      horizontally
//   q_pub(t) = Rz(c) q_prim(t)
//
// With vision, a is where the primitive estimator was at t_f, the time of vision's last word, b
// where vision was, d how much faster vision swam. Whenever b changes, o takes up the difference,
// and goes to zero at a bounded speed; so does c to what vision says. Without vision all of it
// stays as it is, and d becomes the mean of the last seconds: water that moves goes on moving, and
// only cameras notice it. So that losing vision changes nothing at that moment by construction.
//
// Covariance. With vision: vision's, and o o^T. Without: with the displacement D since then, D'
// that turned by +90 degrees, and e the error in heading, the error of the position grows by
// s D + e D' and by what the water does (see primitive.h).

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "estimation/primitive.h"
#include "estimation/state_estimate.h"
#include "estimation/vision_estimate.h"

namespace dive::estimation {

struct HandOverOptions {
  int bad_words = 2;            ///< In a row: then vision is not believed any more.
  double silent_periods = 2.5;  ///< Without a good word: likewise.
  int good_words = 3;           ///< In a row: then it is, again. Twice as many each time that it is
  int most_good_words = 12;     ///< lost soon, up to these.
  double soon_s = 5.0;          ///< Soon.
  double max_age_s = 0.5;       ///< Of a word when it comes.
  double approach = 0.15;       ///< m/s, at which o goes to zero.
  double approach_deg = 3.0;    ///< deg/s, at which c goes to what vision says.
  double drift_time_s = 4.0;    ///< Over which d is averaged for the dark.
  double max_drift = 0.4;       ///< m/s: water does not move faster.
  double drift_memory_s = 60.0;  ///< In the dark d decays with this time constant.
  double drift_sigma = 0.01;     ///< m/s, one sigma, of d, and
  double drift_share = 0.1;      ///< this share of it.
  double max_speed = 2.5;        ///< m/s: faster is no estimate of this vehicle,
  double max_excess = 1.0;       ///< nor one by so much (m/s) other than what is expected,
  double max_tilt_deg = 15.0;    ///< nor roll and pitch so far from those measured.

  /// Empty when usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// Pure: the same calls give the same estimates. Allocates nothing.
class HandOver {
 public:
  /// Demands options that validate.
  HandOver(const HandOverOptions& options, const PrimitiveOptions& primitive);

  /// A word of vision that has come at `now`, before the update() of that tick. What is not finite,
  /// not later than the last or too old counts as a bad one.
  void add(Utime now, const VisionEstimate& vision);
  /// Every tick, with what the primitive estimator says: what is to be published.
  [[nodiscard]] const StateEstimate& update(const StateEstimate& primitive);
  /// By what is seen around it the vehicle is so far (m) from where it was published to be: see
  /// PrimitiveEstimator::moved(). Published at once. Vision's own frame is moved with it, so that
  /// it does not pull back; and like there, it says nothing of where the map is.
  void moved(const Eigen::Vector2d& by_W);

  [[nodiscard]] const StateEstimate& estimate() const { return estimate_; }
  /// Why the source is not vision, as of the last word; kNone while it is.
  [[nodiscard]] VisionFault fault() const { return fault_; }
  /// What is left of the way to where vision says (m).
  [[nodiscard]] double offset_m() const { return offset_W_.norm(); }

 private:
  /// What was said at a tick.
  struct Past {
    Utime utime = 0;
    Eigen::Vector2d p_W = Eigen::Vector2d::Zero();  ///< Of the primitive estimator.
    Eigen::Vector2d v_W = Eigen::Vector2d::Zero();
    Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
    Eigen::Vector2d shift_W = Eigen::Vector2d::Zero();  ///< By moved(), so far.
  };
  static constexpr std::size_t kPast = 256;  ///< Ticks, five seconds.

  [[nodiscard]] const Past& newest() const { return past_[(count_ - 1) % kPast]; }
  /// Interpolated; nothing for a time before those that are kept, or after now.
  [[nodiscard]] std::optional<Past> past_at(Utime utime) const;
  [[nodiscard]] VisionFault judge(Utime now, const VisionEstimate& vision) const;
  [[nodiscard]] bool has_vision() const {
    return estimate_.source == EstimatorKind::kVisualInertial;
  }
  void believe(const VisionEstimate& vision);
  void give_up(VisionFault fault);
  void advance(double dt);
  void publish(const StateEstimate& primitive);
  /// Where newest() is published to be, but for o.
  [[nodiscard]] Eigen::Vector2d target() const;
  [[nodiscard]] Eigen::Matrix3d uncertainty() const;

  HandOverOptions options_;
  PrimitiveOptions primitive_;
  std::array<Past, kPast> past_{};
  std::size_t count_ = 0;  ///< Of ticks so far.
  StateEstimate estimate_;
  bool has_begun_ =
      false;  ///< Until vision was first believed the primitive estimate is published.

  Past anchor_;                                             ///< Holds a and t_f,
  Eigen::Vector2d base_W_ = Eigen::Vector2d::Zero();        ///< b, and how far d has led, m,
  Eigen::Vector2d drift_W_ = Eigen::Vector2d::Zero();       ///< d, m/s,
  Eigen::Vector2d offset_W_ = Eigen::Vector2d::Zero();      ///< o, m,
  double yaw_ = 0.0;                                        ///< c, rad,
  double yaw_target_ = 0.0;                                 ///< and what vision says of it.
  Eigen::Vector2d mean_drift_W_ = Eigen::Vector2d::Zero();  ///< Of d while there is vision, m/s.
  double averaged_s_ = 0.0;                                 ///< Over which, at most drift_time_s.
  double drift_doubt_ = 0.0;  ///< m/s that d was off its mean when vision was lost.
  /// At t_f, of the errors of x, y (W, m) and heading (rad).
  Eigen::Matrix3d base_covariance_ = Eigen::Matrix3d::Zero();
  Eigen::Vector2d shift_W_ = Eigen::Vector2d::Zero();        ///< By moved(), so far.
  Eigen::Vector2d begun_shift_W_ = Eigen::Vector2d::Zero();  ///< The same when vision began.

  std::optional<Utime> begun_from_;
  std::optional<Utime> last_frame_;
  Utime last_good_ = 0;  ///< When it came.
  double period_s_ = 0.05;
  int good_ = 0;  ///< Words in a row.
  int bad_ = 0;
  VisionFault last_bad_ = VisionFault::kNone;
  int good_needed_;
  std::optional<Utime> believed_since_;
  VisionFault fault_ = VisionFault::kStarting;
};

}  // namespace dive::estimation
