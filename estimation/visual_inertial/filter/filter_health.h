#pragma once
// Health of the filter: inputs received and accepted, and divergence.

#include <cstdint>
#include <optional>
#include <string>

#include "estimation/visual_inertial/filter/filter_state.h"
#include "estimation/visual_inertial/filter/scalar_updates.h"
#include "estimation/visual_inertial/filter/visual_update.h"

namespace dive::estimation {

/// Invalid inputs since the start.
struct InputFaults {
  std::int64_t imu_not_finite = 0;
  std::int64_t imu_stamps = 0;     ///< Not newer than the last one, or far ahead.
  std::int64_t imu_saturated = 0;  ///< Used, with large uncertainty.
  std::int64_t imu_gaps = 0;       ///< Bridged, with extra uncertainty.
  std::int64_t depth_not_finite = 0;
  std::int64_t depth_refused = 0;  ///< Rejected by the gate.
  std::int64_t speed_refused = 0;
  std::int64_t late = 0;        ///< Depth, speed or frames older than the state.
  std::int64_t overflowed = 0;  ///< Dropped, because no IMU samples arrived to process them.
  std::int64_t features_ignored = 0;
  std::int64_t features_refused = 0;  ///< Rejected by the gate.
  std::string last;                   ///< The last fault, a sentence.
};

struct FilterHealth {
  VisualReport visual;                   ///< Report of the last frame.
  double visual_innovation_ratio = 1.0;  ///< Smoothed ratio of the last frames used.
  double depth_innovation_ratio = 1.0;   ///< Smoothed ratio of the last depth samples.
  /// Time since a feature, or rest in the images, last updated the state, or since the start.
  double since_visual_s = 0.0;
  bool is_blind = false;  ///< True after a second without a visual update.
  bool is_at_rest = false;
  InputFaults faults;
  std::int64_t features_used = 0;  ///< Updates by tracks and landmarks, over all starts.
  /// Depth has been rejected for max_rejection_s while the images agree with the filter: the depth
  /// sensor is wrong, and the filter continues on images. Cleared when a sample is accepted again.
  bool depth_fault = false;
  /// A measurement disagreed with the configured sensor model within the last 10 s; the covariance
  /// is then not to be trusted.
  bool is_suspect = false;
  std::string suspicion;  ///< Reason, a sentence; stays when the suspicion ends.
  bool diverged = false;  ///< Stays set until the filter is restarted.
  std::string reason;     ///< Reason for divergence, a sentence.
  std::string waits_for;  ///< What the initialisation lacks, in words; empty once it has begun.
};

/// Decides from the innovations whether the filter has diverged.
class HealthWatch {
 public:
  explicit HealthWatch(const VisualInertialOptions& options) : options_(options) {}

  /// `state`: as initialised; its biases and their sigmas are what later ones are compared with.
  void reset(Utime utime, const FilterState& state);
  void on_depth(Utime utime, const UpdateResult& result);
  void on_frame(Utime utime, VisualReport report);
  /// A zero-velocity update by the images. One camera at rest has no other: there is no parallax.
  void on_rest(Utime utime, const UpdateResult& result);
  /// Called after every step: checks that the state is plausible for a vehicle.
  void check(Utime utime, const FilterState& state);
  void on_silence(double seconds);

  FilterHealth health;

 private:
  void diverge(std::string reason);
  /// Disagreement with the configured model, in words; empty if none.
  [[nodiscard]] std::string suspicion_of(Utime utime, const FilterState& state) const;

  VisualInertialOptions options_;
  Utime visual_ = 0;                 ///< Time of the last visual update.
  Utime depth_ = 0;                  ///< Time of the last depth update.
  std::int64_t depth_refused_ = 0;   ///< Consecutive rejected depth samples.
  std::int64_t visual_refused_ = 0;  ///< Consecutive rejected features.
  double refused_share_ = 0.0;       ///< Smoothed fraction of rejected features.
  std::int64_t unmeasured_ = 0;      ///< Saturated or missing IMU samples so far.
  Utime begun_ = 0;
  Vector6d initial_bias_ = Vector6d::Zero();   ///< Gyro, accelerometer.
  Vector6d initial_sigma_ = Vector6d::Ones();  ///< Sigmas of these.
  std::optional<Utime> suspected_at_;          ///< Time of the last suspicion.
};

}  // namespace dive::estimation
