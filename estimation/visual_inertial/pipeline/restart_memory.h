#pragma once
// What is kept of a filter's estimates to begin it again: its biases, and its pose with the
// rotation that the gyro has measured since.

#include <optional>

#include "common/measurements.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/filter/filter_state.h"
#include "estimation/visual_inertial/pipeline/vision_start.h"

namespace dive::estimation {

/// Least sigmas with which the filter begins, whatever an estimate claims.
inline constexpr double kMinStartSigma_m = 0.01;
inline constexpr double kMinStartYawSigma_deg = 0.1;

class RestartMemory {
 public:
  RestartMemory(const VisualInertialOptions& options, const VisionStart& start);

  /// Finite samples, by time.
  void add(const ImuSample& sample);
  /// The filter's estimate, while it has not failed.
  void observe(const StateEstimate& estimate);
  /// The same while it is healthy, and the state it comes from.
  void remember(Utime now, const FilterState& state, const StateEstimate& estimate);
  /// On each start of the filter. `has_failed`: its last estimates are forgotten.
  void restart(bool has_failed);

  /// The biases as last proved, with sigmas grown until `utime`; empty before there are any.
  [[nodiscard]] std::optional<BiasPrior> bias_at(Utime utime) const;
  /// The same as they were found.
  [[nodiscard]] std::optional<ImuBias> proven_bias() const;
  /// A start from images at the pose of the last estimate (VisionStart). Demands a sample.
  [[nodiscard]] ImageStart image_start() const;

 private:
  struct Place {
    Utime utime = 0;
    Pose X_WB;
    double speed = 0.0;  ///< m/s
    double position_sigma_m = 0.0;
    double yaw_sigma = 0.0;                                      ///< rad
    Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();  ///< turned_ then.
    double unmeasured_s = 0.0;                                   ///< unmeasured_s_ then.
  };
  struct Known {
    Utime utime = 0;
    BiasPrior bias;
    Place place;
  };

  [[nodiscard]] Place place_of(const StateEstimate& estimate) const;
  [[nodiscard]] BiasPrior newest_bias() const;

  VisualInertialOptions options_;
  Place first_;  ///< By the given start.
  BiasPrior first_bias_;
  Place last_;  ///< Of the last estimate.
  /// As estimated while the filter was healthy, some time ago, because the cause of a divergence
  /// acts on them first.
  std::optional<Known> proven_;
  std::optional<Known> recent_;
  Utime newest_ = 0;  ///< Time of the newest sample.
  /// Rotation of B by the gyro since the first sample, and the time in it without samples.
  Eigen::Quaterniond turned_ = Eigen::Quaterniond::Identity();
  double unmeasured_s_ = 0.0;
};

/// One sigma of the heading, rad.
[[nodiscard]] double yaw_sigma(const StateEstimate& estimate);

}  // namespace dive::estimation
