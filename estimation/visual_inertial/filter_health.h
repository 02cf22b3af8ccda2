#pragma once
// How the filter fares: what came in, what was believed, and whether it has diverged.

#include <cstdint>
#include <optional>
#include <string>

#include "estimation/visual_inertial/filter_state.h"
#include "estimation/visual_inertial/scalar_updates.h"
#include "estimation/visual_inertial/visual_update.h"

namespace dive::estimation {

/// Of inputs that were not as they should be, since the start.
struct InputFaults {
  std::int64_t imu_not_finite = 0;
  std::int64_t imu_stamps = 0;     ///< Not newer than the last one, or far ahead.
  std::int64_t imu_saturated = 0;  ///< Used, with much doubt.
  std::int64_t imu_gaps = 0;       ///< Bridged, with doubt.
  std::int64_t depth_not_finite = 0;
  std::int64_t depth_refused = 0;  ///< By the gate.
  std::int64_t speed_refused = 0;
  std::int64_t late = 0;        ///< Depth, speed or frames before what has been processed.
  std::int64_t overflowed = 0;  ///< Dropped, because no IMU came to process them with.
  std::int64_t features_ignored = 0;
  std::string last;  ///< The last one, a sentence.
};

struct FilterHealth {
  VisualReport visual;                   ///< Of the last frame.
  double visual_innovation_ratio = 1.0;  ///< Of the last frames that were used, smoothed.
  double depth_innovation_ratio = 1.0;   ///< Of the last depth samples, smoothed.
  double since_visual_s = 0.0;  ///< Since a feature last corrected the state, or the start.
  bool is_blind = false;        ///< That is more than a second ago.
  bool is_still = false;
  InputFaults faults;
  /// Depth has been refused for max_rejection_s while what is seen agrees with the filter: the
  /// depth sensor is wrong, and the filter goes on by its eyes. Until a sample is accepted again.
  bool depth_fault = false;
  /// Within the last 10 s something was unlike what the filter was told of its sensors; the
  /// covariance is then not to be trusted.
  bool doubtful = false;
  std::string doubt;      ///< Of that, a sentence; stays when the doubt is gone.
  bool diverged = false;  ///< Stays so until the filter is started again.
  std::string reason;     ///< Of that, a sentence.
};

/// Decides by what has been seen that the filter has diverged.
class HealthWatch {
 public:
  explicit HealthWatch(const VisualInertialOptions& options) : options_(options) {}

  void reset(Utime utime);
  void on_depth(Utime utime, const UpdateResult& result);
  void on_frame(Utime utime, VisualReport report);
  /// After every step: is the state still one of a vehicle?
  void check(Utime utime, const FilterState& state);
  void on_silence(double seconds);

  FilterHealth health;

 private:
  void diverge(std::string reason);
  /// What is unlike what was told; empty when nothing is.
  [[nodiscard]] std::string doubt_of(Utime utime, const FilterState& state) const;

  VisualInertialOptions options_;
  Utime visual_ = 0;                 ///< When a feature last corrected the state.
  Utime depth_ = 0;                  ///< When a depth sample did.
  std::int64_t depth_refused_ = 0;   ///< In a row.
  std::int64_t visual_refused_ = 0;  ///< Features in a row.
  double refused_share_ = 0.0;       ///< Of the features judged lately, smoothed.
  std::int64_t unmeasured_ = 0;      ///< Samples of the IMU saturated or missing, until now.
  Utime begun_ = 0;
  std::optional<Utime> doubted_;  ///< When there was a doubt last.
};

}  // namespace dive::estimation
