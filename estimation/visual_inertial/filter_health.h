#pragma once
// How the filter fares: what came in, what was believed, and whether it has diverged.

#include <cstdint>
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

  VisualInertialOptions options_;
  Utime visual_ = 0;                 ///< When a feature last corrected the state.
  Utime depth_ = 0;                  ///< When a depth sample did.
  std::int64_t depth_refused_ = 0;   ///< In a row.
  std::int64_t visual_refused_ = 0;  ///< Features in a row.
};

}  // namespace dive::estimation
