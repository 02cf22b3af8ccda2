#pragma once
// The visual-inertial estimator's back end: IMU, features and depth in, StateEstimate out. An MSCKF
// with Jacobians at the newest estimate and a covariance that turns with each correction;
// doc/visual-inertial/ has one page per update.
//
// B is the frame of the IMU. Frames are stamped by the cameras' clock, everything else by the
// IMU's; the offset between the two is part of the state.

#include <deque>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/filter/filter_health.h"
#include "estimation/visual_inertial/filter/image_start.h"
#include "estimation/visual_inertial/filter/zero_velocity_detector.h"
#include "estimation/visual_inertial/front_end/gyro_turn.h"

namespace dive::estimation {

/// Deterministic bit for bit, with bounded memory. The output is finite for every input: unusable
/// inputs are counted in health().faults.
class VisualInertialFilter {
 public:
  /// Demands options and a start that validate.
  VisualInertialFilter(VisualInertialOptions options, FilterStart start);

  /// Re-initialises as soon as `start` can. Keeps the calibration found so far, unless the filter
  /// has diverged: what made it diverge may have acted on the calibration too.
  void restart(FilterStart start);

  void add(const ImuSample& sample);
  void add(const DepthSample& sample);
  void add(FeatureFrame frame);
  /// Adds an expected velocity (m/s, in B), one sigma per axis: weak, against drift in the dark.
  void add_speed(Utime utime, const Eigen::Vector3d& v_WB_B, const Eigen::Vector3d& sigma);

  /// Applies all due updates, and returns the estimate predicted to `now`. Depth and speed wait for
  /// earlier frames, for at most hold_back_s. Demands non-decreasing times. Not valid before
  /// initialisation; predicts at most 2 s beyond the last IMU sample.
  [[nodiscard]] const StateEstimate& update(Utime now);

  [[nodiscard]] const FilterHealth& health() const { return watch_.health; }
  /// Landmarks that updated the state in the last processed frame. As in state(), their covariances
  /// do not contain the depth sensor's constant error.
  [[nodiscard]] std::span<const Landmark> landmarks() const {
    return watch_.health.visual.landmarks;
  }
  /// Access to biases, calibration and window.
  [[nodiscard]] const FilterState& state() const { return state_; }
  /// The gyro's bias as known; before initialisation, as known beforehand.
  [[nodiscard]] GyroBias gyro_bias() const;
  /// Number of frames processed so far.
  [[nodiscard]] std::int64_t state_frames() const { return frames_; }

 private:
  struct Speed {
    Eigen::Vector3d v_B;
    Eigen::Vector3d sigma;
  };
  struct Event {
    Utime utime = 0;  ///< Time by the IMU's clock.
    std::variant<DepthSample, Speed, FeatureFrame> what;
  };
  struct Ahead {
    Utime utime = 0;
    ImuState state;
    Matrix15d covariance;
  };

  void try_to_start();
  [[nodiscard]] std::optional<InitialState> initial_state();
  void push(Event event);
  [[nodiscard]] bool is_due(const Event& event) const;
  void process(const Event& event);
  void apply(const DepthSample& sample);
  void apply(const Speed& speed);
  void apply(const FeatureFrame& frame);
  void propagate_to(Utime utime);
  void advance(Ahead& ahead, Utime to) const;
  void publish(Utime now);

  VisualInertialOptions options_;
  FilterStart start_;
  ImuBuffer imu_;
  FilterState state_;
  VisualUpdate visual_;
  ZeroVelocityDetector still_;
  HealthWatch watch_;
  std::deque<Event> events_;  ///< Events by time.
  ImageInitialiser initialiser_;
  bool started_ = false;
  bool has_height_ = true;  ///< False until the first depth sample after a start without one.
  Utime utime_ = 0;
  Utime last_frame_utime_ = 0;
  std::int64_t frames_ = 0;
  std::optional<Ahead> ahead_;  ///< Prediction so far, while no update has changed the state.
  mutable std::vector<ImuInterval> intervals_;
  StateEstimate estimate_;
};

}  // namespace dive::estimation
