#pragma once
// The open-loop error of a motion model on a recorded dive: the primitive estimator runs over the
// dive without fixes, as on the vehicle, and its motion over some seconds is compared with the
// difference of the positions that fixes show. The compass is corrected by the heading that the
// fixes show: its error is no property of the vehicle.

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/motion_model.h"
#include "estimation/motion_fit/motion_record.h"

namespace dive::estimation {

/// Errors over one horizon.
struct OpenLoopError {
  double horizon_s = 0.0;
  std::vector<double> errors_m;  ///< Horizontal, one for each fix that another follows.

  /// The `share` quantile, m; NaN without errors.
  [[nodiscard]] double quantile(double share) const;
};

/// What the errors of a dive have in common, a constant velocity in W.
enum class Drift {
  kIsCurrent,  ///< Left out: an unknown current. Hides that part of the model's errors too.
  kIsError,    ///< Part of the errors: the water was still.
};

/// One for each horizon (s), over all records.
[[nodiscard]] std::vector<OpenLoopError> open_loop_errors(std::span<const MotionRecord> records,
                                                          const MotionModel& model,
                                                          std::span<const double> horizons_s,
                                                          Drift drift);

/// Standard deviation of the velocity that the model gets wrong for the model's slip_time_s, along
/// the axes of B, m/s: by how much the errors of open-loop motions grow with their time, so that
/// the fixes' own errors do not count. Nothing for an axis that was not horizontal for long enough.
[[nodiscard]] std::array<std::optional<double>, 3> slip_sigmas(
    std::span<const MotionRecord> records, const MotionModel& model);

}  // namespace dive::estimation
